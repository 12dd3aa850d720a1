"""Work on a case without a solve: the name of the case says how it goes."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

from pathwalker_cli.case import Case
from pathwalker_cli.studies.batch.worker import Result

SHORT = 0.2
"""Time that the work takes [s]."""


def fake_work(case: Case, folder: str, warm_start: str) -> Result:
    """Write metrics that follow from the config, die, fail or hang."""
    place = Path(folder)
    kind = place.name.rpartition("--")[2]
    time.sleep(SHORT)
    if kind == "dies" or (kind == "dies_once" and not _been_here(place)):
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "fails":
        raise ZeroDivisionError("a bug")
    if kind == "hangs":
        time.sleep(3600)
    metrics = {
        "status": "the iteration limit was reached" if kind == "is_hard" else "converged",
        "cost": case.config.bounds.friction / 3,
        "walking_speed": 0.7,
        "dorsiflexion_stiffness_right": None,
        "largest_violation": 1e-10,
        "intervals": 32,
        "iterations": 100,
        "seconds_solve": time.perf_counter(),
    }
    place.mkdir(parents=True, exist_ok=True)
    (place / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
    return Result(wrote=True, reason="", detail="", seconds=SHORT, worker=str(os.getpid()))


def die() -> None:
    """End this process before it can do anything."""
    os._exit(3)


def _been_here(place: Path) -> bool:
    """Return whether this was called for a run folder before."""
    mark = place.parent.parent / f".{place.name}.began"
    before = mark.exists()
    mark.touch()
    return before
