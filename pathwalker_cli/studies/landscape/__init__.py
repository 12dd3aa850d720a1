"""Cost and gait over the springs of a side."""
