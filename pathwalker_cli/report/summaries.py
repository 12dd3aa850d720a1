"""What the summaries of studies must hold, as far as a page shows it."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from pathwalker_cli.io.fields import invalid
from pathwalker_cli.stride.measures import measures_in

Number = float | None
Numbers = dict[str, Number]
Pair = tuple[float, float]


def _known(key: str) -> str:
    if key not in {measure.key for measure in measures_in("studies")}:
        raise invalid(f"is '{key}', which is no measure", allowed="a spring of the orthoses")
    return key


class _Block(BaseModel):
    """Further entries may be anything."""

    model_config = ConfigDict(extra="allow")


class Summary(_Block):
    """What every study tells."""

    problem: str
    patient: str


class _Moved(_Block):
    spring: Annotated[str, AfterValidator(_known)] | None = None
    factor: float
    status: str
    changes: Numbers
    note: str


class _Perturbation(Summary):
    optimum: Numbers
    rows: list[_Moved]


class _Sensitivity(Summary):
    optimum: Numbers
    elasticities: dict[str, Numbers]


class _Point(_Block):
    dorsiflexion_stiffness: Number
    plantarflexion_stiffness: Number
    measures: Numbers


class _Best(_Block):
    dorsiflexion_stiffness: float
    plantarflexion_stiffness: float


class _Region(_Block):
    dorsiflexion_stiffness: Pair
    plantarflexion_stiffness: Pair
    share_of_points: float


class _Landscape(Summary):
    side: str
    tolerance: Annotated[float, Field(ge=0.0)]
    dorsiflexion_stiffness: list[float]
    plantarflexion_stiffness: list[float]
    start: _Point
    best: _Best
    region: _Region | None


class _FrontPoint(_Block):
    walking_speed_weight: float
    status: str
    mesh: str | None
    measures: dict[str, float]
    errors: tuple[Number, Number]
    intervals: int
    cost_on_base_mesh: Number
    local_optima: int
    iterations: int


class _Tradeoff(Summary):
    condition: str
    points: Annotated[list[_FrontPoint], Field(min_length=1)]
    base_weight: float
    optimum: Numbers
    recorded_walking_speed: Pair | None
    tolerances: Pair


class _Spread(_Block):
    quantiles: Numbers
    share_at_lower_limit: Number
    share_at_upper_limit: Number
    strongest_input: str | None
    rank_correlation: Number


class _Uncertainty(Summary):
    draws: Annotated[int, Field(ge=0)]
    failed: list[str]
    base: Numbers
    stiffness_ranges: dict[Annotated[str, AfterValidator(_known)], Pair]
    further: dict[str, str] = {}
    spreads: dict[str, _Spread]

    @model_validator(mode="after")
    def _known_spreads(self) -> _Uncertainty:
        for key in self.spreads.keys() - self.further.keys():
            _known(key)
        return self


SUMMARIES: Final[dict[str, type[BaseModel]]] = {
    "perturb": _Perturbation,
    "sensitivity": _Sensitivity,
    "landscape": _Landscape,
    "tradeoff": _Tradeoff,
    "uncertainty": _Uncertainty,
}
"""Model of the summary by the command that writes it."""
