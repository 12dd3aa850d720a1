"""What moving single springs does to an optimum."""
