"""How soles that give way tend to the sole that rolls: the table and figure of docs/accuracy.md.

A walk on soles that roll is followed on soles that sink less and less and creep as much slower:
``python benchmarks/stiffness.py RUN`` with the folder of a converged run with soles.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib import rc_context

from pathwalker_cli.conventions import COORDINATES, SIDES, coordinate_unit
from pathwalker_cli.gait.bounds import recorded_durations
from pathwalker_cli.gait.sinking import sunk
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.model.choices import SOLE_CREEP
from pathwalker_cli.ocp.problem import ProblemNumbers
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.stride.figures.style import NEUTRAL, STYLE, new_figure
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.trajectory import Trajectory

DOCS: Final = Path(__file__).parents[1] / "docs"
PARTS: Final = (1.0, 0.5, 0.25, 0.125)
"""How deep the sole sinks and how fast it creeps, as shares of the published numbers."""
FOLLOW: Final = {"tracking": 1e4, "smoothing": 1e-3}
"""Weights: follow the walk, with just enough on the muscles to make them unique."""
TOLERANCE: Final = 1e-5


@dataclass(frozen=True)
class Point:
    """One sole.

    Args:
        depth: How deep a foot sinks under body weight [m].
        angle: Root mean square difference of all angles to the walk that is followed [rad].
        force: The same of the vertical forces of both feet [N].
    """

    depth: float
    angle: float
    force: float


def study(run_folder: Path) -> list[Point]:
    """Follow the walk of a run on ever stiffer soles."""
    run = load_run(run_folder)
    rolling = gait_series(run.case.walker(), run.motion)
    units = tuple(map(coordinate_unit, COORDINATES))
    way = Trajectory(rolling.time, COORDINATES, rolling.q, units)
    lengths = np.add.reduceat(run.motion.durations, [0, len(run.motion.phases) // 2])
    followed = ReferenceStride("rolling", way, lengths).coordinates
    case, motion, points = run.case.with_values({"model.feet": "compliant"}), None, []
    depth = case.walker().values["sole_depth.right"]
    for part in PARTS:
        numbers = {
            **case.config.numbers,
            "sole_depth": part * depth,
            "sole_creep": part * SOLE_CREEP,
        }
        solver = GaitSolver(case.with_values({"numbers": numbers}))
        if motion is None:
            motion = sunk(solver.walker, run.motion)
        fixed = dict(zip(solver.walker.pattern.names, lengths.tolist(), strict=True))
        free = {("walking_speed",): (0.0, np.inf)} | {
            key: (-np.inf, np.inf) for key in solver.bounds.table.entries if key[-1] == "end"
        }
        table = recorded_durations(solver.bounds, fixed).table.replace(free)
        shared = solver.gait.shared_values(FOLLOW, solver.walker.friction)
        program, result = solver.stage(
            f"depth {part:g}", motion, ProblemNumbers(shared, table, followed),
            solver.settings(TOLERANCE, 1e-4),
        )  # fmt: skip
        if not result.converged:
            raise SystemExit(f"depth {part:g}: {result.status}")
        motion = program.to_motion(result.unknowns)
        series = gait_series(solver.walker, motion)
        angle = series.q[:, 2:] - rolling.q[:, 2:]
        force = [series.vertical_force(s) - rolling.vertical_force(s) for s in SIDES]
        share = series.quadrature / series.duration
        points.append(Point(
            part * depth,
            float(np.sqrt(share @ (angle**2).mean(axis=1))),
            float(np.sqrt(share @ (np.array(force) ** 2).mean(axis=0))),
        ))  # fmt: skip
        print(points[-1], result.iterations, flush=True)
    return points


def draw(points: list[Point]) -> None:
    """Draw both differences over the depth."""
    depths = [1e3 * p.depth for p in points]
    with rc_context(STYLE):
        figure = new_figure(2.3)
        for axes, values, label in zip(
            figure.subplots(1, 2),
            ([np.rad2deg(p.angle) for p in points], [p.force for p in points]),
            ("angles [deg]", "vertical forces [N]"),
            strict=True,
        ):
            axes.loglog(depths, values, marker="o", color=NEUTRAL)
            first = values[0] * np.array(depths) / depths[0]
            axes.loglog(depths, first, ":", color=NEUTRAL, label="first order")
            axes.set_xlabel("depth [mm]")
            axes.set_ylabel(f"difference of {label}")
            axes.set_xticks(depths, [f"{depth:.2g}" for depth in depths])
            axes.set_yticks(values, [f"{value:.2g}" for value in values])
            axes.minorticks_off()
            axes.legend(frameon=False)
        figure.savefig(DOCS / "images" / "stiffness.png", dpi=200)


def page(points: list[Point]) -> str:
    """Return the table of the page."""
    rows = [f"| {1e3 * p.depth:.1f} | {np.rad2deg(p.angle):.3f} | {p.force:.0f} |" for p in points]
    head = "| depth [mm] | angles [deg] | vertical forces [N] |\n| --- | --- | --- |"
    return "\n".join([head, *rows])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="folder of a converged run with soles")
    found = study(parser.parse_args().run)
    draw(found)
    print(page(found))
