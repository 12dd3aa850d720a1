"""How MAPD-Barefoot converges with the mesh: the table and figure of docs/accuracy.md.

Meshes of 32, 64 and 128 intervals with two collocation degrees, dealt out by phase duration and not
refined, all at the same local optimum: ``python benchmarks/convergence.py RUN`` with the folder of
a converged run of mapd-barefoot.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib import rc_context

from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.stride.figures.style import NEUTRAL, STYLE, new_figure
from pathwalker_cli.stride.verify import reintegrate

DOCS: Final = Path(__file__).parents[1] / "docs"
DEGREES: Final = (2, 3)
INTERVALS: Final = (32, 64, 128)
TOLERANCE: Final = 1e-7


@dataclass(frozen=True)
class Point:
    """One mesh.

    Args:
        degree: Radau points per interval.
        intervals: Intervals in all phases.
        cost: Value of the objective.
        walking_speed: Walking speed [m/s].
        median_error: Median over intervals of the re-integration error of q [rad, m].
        worst_error: Largest one.
        iterations: Iterations.
    """

    degree: int
    intervals: int
    cost: float
    walking_speed: float
    median_error: float
    worst_error: float
    iterations: int


def study(run_folder: Path) -> list[Point]:
    """Solve on all meshes, the finest first, each from the one before."""
    run = load_run(run_folder)
    before: tuple[CollocationProgram, NlpResult] | None = None
    motion, points = run.motion, []
    for degree in reversed(DEGREES):
        solver = GaitSolver(run.case.with_values({"mesh.degree": degree}))
        for intervals in reversed(INTERVALS):
            meshes = meshing.by_duration(run.motion.durations, intervals, 2)
            barrier = 1e-4 if before is None else 1e-6
            settings = solver.settings(TOLERANCE, barrier, warm=before is not None)
            name = f"degree {degree}, {intervals} intervals"
            start = motion.resampled(meshes, degree)
            program, result = solver.stage(name, start, solver.prediction, settings, before)
            if not result.converged:
                raise SystemExit(f"{name}: {result.status}")
            before, motion = (program, result), program.to_motion(result.unknowns)
            errors = np.concatenate(reintegrate(solver.walker, motion).position)
            points.append(
                Point(
                    degree,
                    motion.intervals,
                    result.objective,
                    walked_distance(motion) / motion.duration,
                    float(np.median(errors)),
                    float(errors.max()),
                    result.iterations,
                )
            )
            print(points[-1], flush=True)
    return points


def orders(points: list[Point]) -> dict[int, float]:
    """Return the measured order of the median error in the number of intervals, per degree."""
    result = {}
    for degree in DEGREES:
        line = [p for p in points if p.degree == degree]
        counts, errors = np.array([(p.intervals, p.median_error) for p in line]).T
        result[degree] = float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])
    return result


def draw(points: list[Point]) -> None:
    """Draw cost and errors over the number of intervals."""
    finest = max(points, key=lambda p: (p.degree, p.intervals))
    with rc_context(STYLE):
        figure = new_figure(4.2)
        left, right = figure.subplots(2, 1)
        for degree, marker, line in zip(DEGREES, "os", ("--", "-"), strict=True):
            chosen = sorted((p for p in points if p.degree == degree), key=lambda p: p.intervals)
            counts = [p.intervals for p in chosen]
            label = f"{degree} points per interval"
            costs = [100 * (p.cost / finest.cost - 1) for p in chosen]
            left.plot(counts, costs, line, marker=marker, color=NEUTRAL, label=label)
            for name, colour in (("median", "#0072B2"), ("worst", "#D55E00")):
                errors = [getattr(p, f"{name}_error") for p in chosen]
                label = f"{name}, {degree} points"
                right.loglog(counts, errors, line, marker=marker, color=colour, label=label)
        left.set_xscale("log", base=2)
        left.set_ylabel("cost above the finest mesh [%]")
        right.set_ylabel("re-integration error of q [rad, m]")
        right.yaxis.set_major_formatter("{x:.0e}")
        right.set_ylim(bottom=1e-11)  # room for the legend
        for axes in (left, right):
            axes.set_xlabel("mesh intervals")
            axes.set_xticks(INTERVALS, [str(k) for k in INTERVALS])
            axes.minorticks_off()
            axes.legend(frameon=False, loc="best" if axes is left else "lower left")
        figure.savefig(DOCS / "images" / "convergence.png", dpi=200)


def page(points: list[Point]) -> str:
    """Return the table of the page."""
    rows = [
        f"| {p.degree} | {p.intervals} | {p.cost:.5f} | {p.walking_speed:.4f} "
        f"| {p.median_error:.1e} | {p.worst_error:.1e} | {p.iterations} |"
        for p in sorted(points, key=lambda p: (p.degree, p.intervals))
    ]
    found = ", ".join(
        f"{order:.1f} with {degree} points" for degree, order in orders(points).items()
    )
    head = (
        "| points per interval | intervals | cost | speed [m/s] | median error | worst error "
        "| iterations |\n| --- | --- | --- | --- | --- | --- | --- |"
    )
    return "\n".join([head, *rows, "", f"Measured order of the median error: {found}.", ""])


def main() -> None:
    """Run the study, write its table to the terminal and its figure to the docs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    points = study(parser.parse_args().run)
    draw(points)
    print(page(points))


if __name__ == "__main__":
    main()
