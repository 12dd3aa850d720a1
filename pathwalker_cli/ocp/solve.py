"""The name by which scripts import `solve_study`; it stands in `gait.solve`."""

from pathwalker_cli.gait.solve import solve_study as solve_study
