"""Run folders for reports and comparisons, without a solve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from conftest import MadeSolution
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.studies.verdict import NumberVerdict, SnappedSprings, StopVerdict, Verdict

HOSTILE = "<script>alert(1)</script>"


def made_verdict(**changes: Any) -> Verdict:
    """Return a verdict: K_D at its upper limit, K_P left open by the cost."""
    springs = tuple(
        NumberVerdict(
            name,
            f"K_{name[0].upper()} {name.rpartition('_')[2]}",
            "N m/rad",
            92.0 if name.startswith("d") else 6.0,
            (5.0, 92.0),
            "upper" if name.startswith("d") else "",
            -1e-3 if name.startswith("d") else 0.0,
            1e-4,
            (60.0, 92.0) if name.startswith("d") else (5.0, 92.0),
            (False, True),
            True,
        )
        for name in STIFFNESSES
    )
    values: dict[str, Any] = {
        "springs": springs,
        "numbers": (),
        "stops": (StopVerdict("right", "dorsiflexion", -0.13, 0.05, 0.3),),
        "snapped": SnappedSprings(
            {name: "stiff" if name.startswith("d") else "softest" for name in STIFFNESSES},
            {name: 91.7 if name.startswith("d") else 5.0 for name in STIFFNESSES},
            0.001,
            0.636,
            "converged",
        ),
        "optima": (),
        "starts": 0,
        "solves": 9,
        "seconds": 1.0,
    }
    return Verdict(**(values | changes))


def write_made_run(folder: Path, made: MadeSolution, problem: str, **changes: Any) -> Path:
    """Write a run without figures; one with orthoses has a verdict; return its folder."""
    more: dict[str, Any] = {}
    if problem == "mapd-orthosis":
        more["verdict"] = made_verdict().as_dict()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
        write_run(folder, made(problem, **changes), more=more)
    return folder
