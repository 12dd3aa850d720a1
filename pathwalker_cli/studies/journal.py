"""Solved neighbours on disk: a study that was interrupted goes on where it was."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.case import Case, config_text
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.nlp.ipopt import Multipliers, NlpResult
from pathwalker_cli.results.metrics import sha256
from pathwalker_cli.results.motion_file import read_arrays
from pathwalker_cli.results.run_folder import Run

__all__ = ["STOPPED", "Journal"]

STOPPED: Final = "stopped by the user; the same command goes on from there"
"""Why nothing further is solved."""

_NUMBERS: Final = ("objective", "iterations", "seconds", "seconds_functions")


class Journal:
    """Solves neighbours of a run, each only once per folder.

    Args:
        folder: Where solved neighbours are kept, one file each.
        run: The run whose neighbours they are; files made from another run are not used.
        resolver: Solves what is not there yet.
    """

    def __init__(self, folder: Path, run: Run, resolver: Resolver) -> None:
        self.folder = folder
        self.resolver = resolver
        self._origin = f"{run.metrics['motion_hash']} {run.case.content_hash}"
        self.solved = 0
        """Neighbours that were solved by this journal, not read."""

    def resolve(self, name: str, case: Case, start: Optimum | None = None) -> Optimum:
        """Return a solved neighbour, read or solved now; see `Resolver.resolve`.

        Args:
            name: Name of its file, unique in the study.
            case: Its case.
            start: Neighbour to begin with.

        Raises:
            NotConvergedError: If the user stopped it: nothing further is wanted then.
        """
        seal = sha256(f"{self._origin} {config_text(case.config)}".encode())
        path = self.folder / f"{name}.npz"
        result = _read(path, seal)
        if result is not None:
            return self.resolver.restored(case, result)
        optimum = self.resolver.resolve(case, start)
        self.solved += 1
        if optimum.result.status == "stopped by the user":
            raise NotConvergedError(STOPPED)
        _write(path, seal, optimum.result)
        return optimum


def _write(path: Path, seal: str, result: NlpResult) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    facts = {"seal": seal, "status": result.status}
    facts |= {name: getattr(result, name) for name in _NUMBERS}
    with atomic_open(path, "wb") as file:
        np.savez(
            file,
            facts=np.array(json.dumps(facts)),
            unknowns=result.unknowns,
            rows=result.rows,
            bound_multipliers=result.multipliers.unknowns,
            row_multipliers=result.multipliers.rows,
            allow_pickle=False,
        )


def _read(path: Path, seal: str) -> NlpResult | None:
    """Return a result; None if it is not there, damaged or of another origin."""
    if not path.is_file():
        return None
    try:
        arrays = read_arrays(path)
        facts = json.loads(str(arrays["facts"]))
        if facts["seal"] != seal:
            return None
        return NlpResult(
            status=facts["status"],
            unknowns=arrays["unknowns"],
            rows=arrays["rows"],
            multipliers=Multipliers(arrays["bound_multipliers"], arrays["row_multipliers"]),
            **{name: facts[name] for name in _NUMBERS},
        )
    except (DataError, KeyError, ValueError, TypeError):
        return None
