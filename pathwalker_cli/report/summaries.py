"""What studies around an optimum leave behind, as far as a page shows it; the rest may be anything.

What a study wrote as a whole is read back as the very type that it was; of the others only what a
page needs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, RootModel, model_validator

from pathwalker_cli.io.csv_file import read_rows
from pathwalker_cli.io.fields import invalid
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.landscape.result import ROOT, Landscape, Point
from pathwalker_cli.studies.measures import Ranges, measures_with
from pathwalker_cli.studies.tradeoff.result import Number as NumberOrNan
from pathwalker_cli.studies.tradeoff.result import Tradeoff
from pathwalker_cli.studies.uncertainty.result import QUANTILES, Spread

Number = float | None
Numbers = dict[str, Number]
Pair = tuple[float, float]

_KINDS: Final = ("dorsiflexion_stiffness", "plantarflexion_stiffness")


def _known(key: str) -> str:
    if key not in {measure.key for measure in measures_in("studies")}:
        raise invalid(f"is '{key}', which is no measure", allowed="a spring of the orthoses")
    return key


Spring = Annotated[str, AfterValidator(_known)]


class _Block(BaseModel):
    model_config = ConfigDict(extra="allow")


class Summary(_Block):
    """What every study tells."""

    problem: str
    patient: str


class Moved(_Block):
    """A number that `perturb` moved: a spring, or another one with its label and unit."""

    spring: Spring | None = None
    label: str = ""
    factor: float
    stiffness: Number = None
    value: Number = None
    unit: str = ""
    status: str
    changes: Numbers
    note: str


class PerturbationSummary(Summary):
    """What `perturb` tells."""

    optimum: Numbers
    rows: list[Moved]


class SensitivitySummary(Summary):
    """What `sensitivity` tells."""

    optimum: Numbers
    elasticities: dict[str, Numbers]


class _Point(_Block):
    dorsiflexion_stiffness: Number
    plantarflexion_stiffness: Number
    measures: Numbers


class _Region(_Block):
    dorsiflexion_stiffness: Pair
    plantarflexion_stiffness: Pair
    share_of_points: float


class LandscapeSummary(Summary):
    """What `landscape` tells beside its table."""

    side: str
    tolerance: Annotated[float, Field(ge=0.0)]
    dorsiflexion_stiffness: list[float]
    plantarflexion_stiffness: list[float]
    start: _Point
    best: _Point
    region: _Region | None


class TradeoffSummary(RootModel[Tradeoff]):
    """A trade-off as it was."""


class _Spread(_Block):
    quantiles: dict[str, NumberOrNan]
    share_at_lower_limit: Number
    share_at_upper_limit: Number
    strongest_input: str | None
    rank_correlation: Number


class _First(_Block):
    place: str
    share: float
    chance: bool


class UncertaintySummary(Summary):
    """What `uncertainty` tells beside its table of draws."""

    draws: Annotated[int, Field(ge=0)]
    failed: list[str]
    base: dict[str, float]
    stiffness_ranges: dict[Spring, Pair]
    number_ranges: dict[str, Pair] = {}
    further: dict[str, str] = {}
    spreads: dict[str, _Spread]
    advice: list[str] = []
    measure_first: _First | None = None

    @model_validator(mode="after")
    def _known_spreads(self) -> UncertaintySummary:
        for key in self.spreads.keys() - self.further.keys():
            _known(key)
        return self

    def span(self, key: str) -> tuple[float, float]:
        """Return the range of a measure without its tails [SI]."""
        low, *_, high = (self.spreads[key].quantiles[str(q)] for q in QUANTILES)
        return low, high

    @property
    def ranges(self) -> Ranges:
        """Allowed range of every spring and further number [SI]."""
        return self.stiffness_ranges | self.number_ranges


class _LearntNumber(_Block):
    learnt: float
    prior: float
    unit: str
    interval: Pair
    told: float


class LearnSummary(Summary):
    """What `learn` tells."""

    condition: str
    rms_mean_cycle: dict[str, float]
    rms_own_cycles: dict[str, float]
    numbers: dict[str, _LearntNumber]
    active_bounds: list[str]


SUMMARIES: Final[dict[str, type[BaseModel]]] = {
    "perturb": PerturbationSummary,
    "sensitivity": SensitivitySummary,
    "landscape": LandscapeSummary,
    "tradeoff": TradeoffSummary,
    "uncertainty": UncertaintySummary,
    "learn": LearnSummary,
}
"""What the summary holds by the command that writes it."""


def landscape_of(summary: LandscapeSummary, folder: Path) -> Landscape:
    """Return a landscape with the points of its table; what its solves took is left out.

    Raises:
        DataError: If its table cannot be read.
        KeyError, TypeError, ValueError: If its table is not that of `landscape`.
    """
    more = summary.model_extra or {}
    rows = read_rows(folder / "landscape.csv", ("point", *_KINDS, "branch", "cost"))
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
    return Landscape(
        patient=summary.patient,
        problem=summary.problem,
        side=summary.side,
        k_d=_as_written(summary.dorsiflexion_stiffness),
        k_p=_as_written(summary.plantarflexion_stiffness),
        points=points,
        optimum=next(point for point in points if point.name == ROOT),
        released=None,
        checks={},
        allowed=(np.inf, np.inf),
        tolerance=summary.tolerance,
        solves=int(more["solves"]),
        failed_solves=int(more["failed_solves"]),
        iterations=(),
        seconds=float(more["seconds"]),
        sweeps=int(more["sweeps"]),
        complete=bool(more["sweeps_found_nothing_new"]),
    )


def _as_written(values: list[float]) -> np.ndarray:
    """Return stiffnesses with the digits of the table, so that they are found in it."""
    return np.array([float(f"{value:.9g}") for value in values])


def spreads_of(
    summary: UncertaintySummary, folder: Path
) -> tuple[dict[str, np.ndarray], tuple[Spread, ...]]:
    """Return every measure of all converged draws, SI units, and how they spread.

    Raises:
        DataError: If its table cannot be read.
        KeyError, TypeError, ValueError: If its table is not that of `uncertainty`.
    """
    measures = {m.key: m for m in measures_with(summary.further)}
    rows = read_rows(folder / "draws.csv", ("draw", "status", *summary.spreads))
    solved = [row for row in rows if row["cost"]]
    values = {key: np.array([float(row[key]) for row in solved]) for key in summary.spreads}
    spreads = tuple(
        Spread(
            measure=measures[key],
            base=summary.base[key],
            quantiles=tuple(entry.quantiles[str(q)] for q in QUANTILES),
            lower=entry.share_at_lower_limit,
            upper=entry.share_at_upper_limit,
            correlations=np.zeros(0),
            strongest=None,
        )
        for key, entry in summary.spreads.items()
    )
    return values, spreads
