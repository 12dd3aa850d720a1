"""Studies around an optimum as their files tell them, so that their figures can be drawn again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pathwalker_cli.io.csv_file import read_rows
from pathwalker_cli.report.folders import Study
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.landscape.result import ROOT, Landscape, Point
from pathwalker_cli.studies.measures import Ranges, measures_with
from pathwalker_cli.studies.uncertainty.result import Spread

_KINDS = ("dorsiflexion_stiffness", "plantarflexion_stiffness")


def landscape_of(study: Study) -> Landscape:
    """Return a landscape; what its solves took is left out.

    Raises:
        DataError: If its table cannot be read.
        KeyError, TypeError, ValueError: If its files are not those of `landscape`.
    """
    content = study.content
    rows = read_rows(study.folder / "landscape.csv", ("point", *_KINDS, "branch", "cost"))
    points = tuple(
        Point(
            name=row["point"],
            k_d=float(row[_KINDS[0]]),
            k_p=float(row[_KINDS[1]]),
            branch=int(row["branch"]),
            status=row["status"],
            iterations=0,
            seconds=0.0,
            measures={m.key: float(row[m.key]) for m in measures_in("studies") if row.get(m.key)},
        )
        for row in rows
    )
    k_d, k_p = (_as_written(content[kind]) for kind in _KINDS)
    return Landscape(
        patient=str(content["patient"]),
        problem=str(content["problem"]),
        side=str(content["side"]),
        k_d=k_d,
        k_p=k_p,
        points=points,
        optimum=next(point for point in points if point.name == ROOT),
        released=None,
        checks={},
        allowed=(np.inf, np.inf),
        tolerance=float(content["tolerance"]),
        solves=int(content["solves"]),
        failed_solves=int(content["failed_solves"]),
        iterations=(),
        seconds=float(content["seconds"]),
        sweeps=int(content["sweeps"]),
        complete=bool(content["sweeps_found_nothing_new"]),
    )


def _as_written(values: list[float]) -> np.ndarray:
    """Return stiffnesses with the digits of the table, so that they are found in it."""
    return np.array([float(f"{value:.9g}") for value in values])


@dataclass(frozen=True)
class Spreads:
    """How measures spread over the draws of an uncertainty study.

    Args:
        values: Every measure of all converged draws, SI units, each of shape (n,).
        ranges: Allowed range by spring [N m/rad].
        spreads: What the study says of each measure, correlations apart.
        strongest: The input that a measure follows most, by measure, where there is one.
        draws: Number of draws.
        failed: Those of them that did not converge.
    """

    values: dict[str, np.ndarray]
    ranges: Ranges
    spreads: tuple[Spread, ...]
    strongest: dict[str, str]
    draws: int
    failed: int


def spreads_of(study: Study) -> Spreads:
    """Return how measures spread.

    Raises:
        DataError: If its table cannot be read.
        KeyError, TypeError, ValueError: If its files are not those of `uncertainty`.
    """
    content = study.content
    entries: dict[str, dict[str, Any]] = content["spreads"]
    measures = {m.key: m for m in measures_with(content.get("further", {}))}
    rows = read_rows(study.folder / "draws.csv", ("draw", "status", *entries))
    solved = [row for row in rows if row["cost"]]
    spreads = tuple(
        Spread(
            measure=measures[key],
            base=float(content["base"][key]),
            quantiles=tuple(
                np.nan if entry["quantiles"][q] is None else float(entry["quantiles"][q])
                for q in ("0.05", "0.5", "0.95")
            ),
            lower=entry["share_at_lower_limit"],
            upper=entry["share_at_upper_limit"],
            correlations=np.zeros(0),
            strongest=None,
        )
        for key, entry in entries.items()
    )
    return Spreads(
        values={key: np.array([float(row[key]) for row in solved]) for key in entries},
        ranges={
            name: (pair[0], pair[1])
            for key in ("stiffness_ranges", "number_ranges")
            for name, pair in content.get(key, {}).items()
        },
        spreads=spreads,
        strongest={k: e["strongest_input"] for k, e in entries.items() if e["strongest_input"]},
        draws=int(content["draws"]),
        failed=len(content["failed"]),
    )
