"""The name by which scripts import `solve_study`; it stands in `gait.solve`."""
