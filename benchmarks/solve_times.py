"""Where the time of a solve goes: CPU seconds by part, and per iteration.

Run on a quiet machine: ``python benchmarks/solve_times.py [CONFIG] [--set key=value ...]``.
Ratios within one run are comparable; absolute times on shared machines drift.
"""

from __future__ import annotations

import argparse
import json
import resource
import time

from pathwalker_cli.config import load_config
from pathwalker_cli.ocp.solution import GaitSolution
from pathwalker_cli.ocp.solve import GaitSolver


def cpu_seconds() -> float:
    """Return the CPU seconds of this process, user and system."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def summary(
    solution: GaitSolution, build_cpu: float, total_cpu: float, wall: float
) -> dict[str, object]:
    """Return the figures of one run."""
    stages = [
        {
            "stage": stage.name,
            "status": stage.status,
            "intervals": stage.intervals,
            "unknowns": stage.unknowns,
            "iterations": stage.iterations,
            "seconds": round(stage.seconds, 2),
            "seconds_per_iteration": round(stage.seconds / max(stage.iterations, 1), 4),
            "share_in_functions": round(stage.seconds_functions / stage.seconds, 3),
        }
        for stage in solution.stages
    ]
    return {
        "problem": solution.config.problem,
        "status": solution.status,
        "cost": solution.cost,
        "cpu_seconds_build": round(build_cpu, 2),
        "cpu_seconds_total": round(total_cpu, 2),
        "wall_seconds_total": round(wall, 2),
        "peak_memory_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "stages": stages,
    }


def main() -> None:
    """Solve one config and print its figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("config", nargs="?", default="mapd-orthosis")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    wall, cpu = time.perf_counter(), cpu_seconds()
    solver = GaitSolver(load_config(arguments.config, changes=tuple(arguments.set)))
    build = cpu_seconds() - cpu
    solution = solver.solve()
    figures = summary(solution, build, cpu_seconds() - cpu, time.perf_counter() - wall)
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    main()
