"""A study in one module: what the optimum costs at a few least speeds."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import NeighbourStudy, Plan, StudyKind, Work
from pathwalker_cli.studies.measures import measures
from pathwalker_cli.studies.neighbours import Neighbours


class SpeedStudy(NeighbourStudy):
    """Costs at given speeds."""

    least_speeds: tuple[float, ...] = (0.7, 0.8, 0.9)


@dataclass(frozen=True)
class Costs:
    """What speeds cost.

    Args:
        problem: The problem.
        patient: Id of the patient.
        optimum: Measures of the optimum; SI units.
        costs: Cost by least speed, None where there is no solution.
    """

    problem: str
    patient: str
    optimum: dict[str, float]
    costs: dict[str, float | None]


def plan(study: SpeedStudy, solver: GaitSolver) -> Plan:
    """Return how many speeds there are."""
    count = len(study.least_speeds)
    return Plan(f"{count} least speeds", count)


def costs(study: SpeedStudy, run: Run, work: Work) -> Costs:
    """Solve the problem for every speed."""
    near = Neighbours(run, work.folder / "points", 200, work.report)
    by_speed: dict[str, float | None] = {}
    for speed in study.least_speeds:
        case = run.case.with_values({"bounds.least_walking_speed": speed})
        end = near.resolve(f"v{speed:g}", case, None)
        by_speed[f"{speed:g}"] = end.cost if end.converged else None
    return Costs(run.config.problem, run.case.unvaried.id, measures(near.optimum), by_speed)


def write(result: Costs, folder: Path) -> None:
    """Write the summary."""
    write_json(folder / "speeds.json", asdict(result))


def lines(result: Costs) -> list[str]:
    """Return one line per speed."""
    return [f"{speed} m/s: cost {cost}" for speed, cost in result.costs.items()]


def failed(result: Costs, folder: Path) -> str:
    """Return which speeds have no solution."""
    none = [speed for speed, cost in result.costs.items() if cost is None]
    return f"no solution at {', '.join(none)} m/s" if none else ""


STUDY: Final[StudyKind[SpeedStudy, Costs]] = StudyKind(
    model=SpeedStudy,
    files=frozenset({"points", "speeds.json"}),
    varies="",
    plan=plan,
    run=costs,
    write=write,
    content=asdict,
    lines=lines,
    failed=failed,
    predicts=True,
)
