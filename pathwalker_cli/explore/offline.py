"""A page of an explored run that needs no server: solved points, and first-order changes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from pathwalker_cli.explore.page import explore_page, picture
from pathwalker_cli.explore.session import Session
from pathwalker_cli.report.folders import studies_near
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.landscape import (
    LandscapeStudy,
    point_name,
    varied_springs,
    with_springs,
)
from pathwalker_cli.studies.neighbours import Journal

_STEP: Final = 0.02
"""Share of a dial's range over which its first-order change is told."""


def offline_page(run: Run) -> str:
    """Return the page of a run; one landscape near it is made use of, see `report.folders`.

    Raises:
        NotConvergedError: If the run cannot be solved again.
    """
    session = Session(run)
    content = {"steps": list(_steps(session)), "landscape": _landscape(session)}
    return explore_page(session, run.folder.resolve().name, content)


def _steps(session: Session) -> Iterator[dict[str, Any]]:
    """Yield the state that one step of every dial leads to, to first order."""
    for dial in session.dials:
        step = _STEP * (dial.high - dial.low)
        step = step if dial.value + step <= dial.high else -step
        end = session.first_order({dial.key: dial.value + step})
        if end is not None:
            yield {"key": dial.key, "step": step, "state": picture(end, session.dials)}


def _landscape(session: Session) -> dict[str, Any] | None:
    """Return the solved points of a landscape near the run, None where no solution is."""
    run = session.run
    found = [s for s in studies_near([(run.folder, run.metrics)], {}) if s.kind == "landscape"]
    if not found:
        return None
    study, content = found[0], found[0].content
    side = LandscapeStudy(base="", side=content["side"])
    springs = varied_springs(side, session.optimum.solver.walker.unknowns)
    k_d, k_p = content["dorsiflexion_stiffness"], content["plantarflexion_stiffness"]
    journal = Journal(study.folder / "points", run, session.resolver)

    def state(i: int, j: int) -> dict[str, Any] | None:
        case = with_springs(run.case, springs, (k_d[i], k_p[j]))
        files = sorted(journal.folder.glob(f"{point_name(i, j)}.from.*.npz"))
        ends = (journal.kept(file.name.removesuffix(".npz"), case) for file in files)
        solved = [end for end in ends if end is not None and end.converged]
        best = min(solved, key=lambda end: end.cost, default=None)
        return None if best is None else picture(best, session.dials)

    return {
        "keys": [[unknown.address for unknown in unknowns] for unknowns in springs],
        "values": [k_d, k_p],
        "states": [[state(i, j) for j in range(len(k_p))] for i in range(len(k_d))],
    }
