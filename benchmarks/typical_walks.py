"""Find the walks that a solve begins with: `python benchmarks/typical_walks.py [NAME ...]`.

Each is the optimum of a made-up child on a coarse mesh, from a synthetic stride; it is written into
configs/walks for `pathwalker_cli.gait.typical`. None of the children is a patient that is shipped.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Final

import numpy as np
from hard_cases import Case, write_child

from pathwalker_cli.case import load_case
from pathwalker_cli.gait.motion_file import read_arrays, write_motion
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.paths import shipped

CHILDREN: Final = (
    Case("half", 9.0, "real"),
    Case("strong", 6.5, "soft"),
    Case("third", 12.0, "stiff"),
)
CONFIGS: Final = {"points": ("mapd", 52), "sole": ("predict", 64)}
"""Shipped configs for each kind of feet, and the mesh intervals of the walk."""


def main() -> None:
    """Solve and write the walks that are asked for, or all."""
    folder = shipped("configs") / "walks"
    folder.mkdir(exist_ok=True)
    wanted = sys.argv[1:]
    for feet, (config, intervals) in CONFIGS.items():
        for condition in ("barefoot", "orthosis"):
            for child in CHILDREN:
                name = f"{child.kind}-{child.age:g}y-{feet}-{condition}".replace(".", "_")
                if wanted and name not in wanted:
                    continue
                solution = solved(child, f"{config}-{condition}", f"mapd-{condition}", intervals)
                print(f"{name}: {solution.status}, cost {solution.cost:.5g}", flush=True)
                if solution.converged:
                    write_walk(folder / f"{name}.npz", solution)


def solved(child: Case, config: str, problem: str, intervals: int) -> GaitSolution:
    """Return the optimum of a made-up child with a shipped config on a coarse mesh."""
    with tempfile.TemporaryDirectory() as folder:
        write_child(child, Path(folder) / child.id)
        changes = (
            f"patient={Path(folder) / child.id}", "start.gait=synthetic", "mesh.refinements=0",
            f"mesh.intervals={intervals}",
        )  # fmt: skip
        return GaitSolver(load_case(config, problem, changes)).solve()


def write_walk(path: Path, solution: GaitSolution) -> None:
    """Write a walk and what it scales by, in single precision: the next solve polishes it."""
    walker = solution.walker
    write_motion(path, solution.last_motion)
    arrays = dict(read_arrays(path))
    arrays |= {"leg_length": np.array(walker.leg_length), "weight": np.array(walker.weight)}
    arrays["strengths"] = walker.max_isometric_torque
    small = {k: v.astype(np.float32) if v.dtype.kind == "f" else v for k, v in arrays.items()}
    np.savez_compressed(path, allow_pickle=False, **small)


if __name__ == "__main__":
    main()
