"""Walking as an optimal control problem: posed, begun, solved, varied."""
