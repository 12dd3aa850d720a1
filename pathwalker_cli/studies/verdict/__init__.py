"""How sure an identified number is: limits, cost around it, stops, real springs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.solution import LocalOptimum
from pathwalker_cli.io.refusals import dotted
from pathwalker_cli.stride.measures import measure_of

SHARE: Final = 0.05
"""Rise of the cost that still counts as good."""

_DETERMINED: Final = 0.25
"""Share of the range of springs up to which a region determines a spring."""

_ROUGHLY: Final = 0.75
"""Share of the range of springs up to which a region still says something."""

LOADED: Final = 0.25
"""Share of an orthosis' torque from which on a stop counts as one of its springs."""

STIFFER: Final = 0.1
"""How much stiffer a stop is made, as a share."""

NOT_DETERMINED: Final = "not determined"


@dataclass(frozen=True)
class NumberVerdict:
    """What is known of one identified number; the others follow when it moves.

    Args:
        name: Its name: of a spring as in `conventions.STIFFNESSES`, else of the unknown.
        label: Its name for people.
        unit: SI unit.
        value: Identified value [unit].
        range: Allowed values [unit].
        limit: "lower" or "upper" if it sits at a limit of its range, else "".
        gradient: Relative change of the cost per unit; 0 inside the range.
        curvature: Relative second derivative of the cost [1/unit^2].
        region: Values within which the cost stays within `SHARE` of the best [unit].
        open_ends: Whether the region reaches the lower and the upper limit of the range.
        certain: Whether solves enclose both ends of the region.
        again: Whether the cost is within `SHARE` again at the lower and the upper limit, beyond
            the region: another local optimum.
        tied: Whether both sides are one number.
    """

    name: str
    label: str
    unit: str
    value: float
    range: tuple[float, float]
    limit: str
    gradient: float
    curvature: float
    region: tuple[float, float]
    open_ends: tuple[bool, bool]
    certain: bool
    again: tuple[bool, bool] = (False, False)
    tied: bool = False

    @property
    def prescribed(self) -> bool:
        """Whether the config leaves no choice."""
        return self.range[0] == self.range[1]

    @property
    def width(self) -> float:
        """Share of the range that the region covers; 0 of a range without width."""
        if self.prescribed:
            return 0.0
        return (self.region[1] - self.region[0]) / (self.range[1] - self.range[0])

    @property
    def determined(self) -> str:
        """How well least effort determines the number, in words."""
        if self.prescribed:
            return "prescribed"
        if any(self.again) or self.width > _ROUGHLY:
            return NOT_DETERMINED
        if self.limit:
            return "set by its limit"
        return "determined" if self.width <= _DETERMINED else "roughly determined"


@dataclass(frozen=True)
class StopVerdict:
    """Whether a hard stop is reached.

    Args:
        side: "right" or "left".
        stop: "dorsiflexion" or "plantarflexion".
        angle: Angle of the stop [rad].
        excess: How far the ankle goes beyond it at most [rad]; negative if it is not reached.
        share: Share of the stride beyond it.
        torque: The largest torque on it [N m].
        carried: Its share of the impulse of what the orthosis exerts in its direction.
        stiffness: Its stiffness [N m/rad].
        stiffer: What `STIFFER` more stiffness of it changes, to first order, all else optimal
            again: the cost as a share, then measures and free numbers by name [SI].  Empty where it
            carries less than `LOADED`.
    """

    side: str
    stop: str
    angle: float
    excess: float
    share: float
    torque: float = 0.0
    carried: float = 0.0
    stiffness: float = 0.0
    stiffer: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SnappedSprings:
    """The best choice among the springs that exist.

    Args:
        names: Name of the spring for each identified one.
        stiffness: Their stiffness [N m/rad].
        rise: What the cost rises by, as a share, all else solved again.
        walking_speed: Walking speed with them [m/s].
        status: "converged", or why not: then `rise` is an estimate.
    """

    names: dict[str, str]
    stiffness: dict[str, float]
    rise: float
    walking_speed: float
    status: str


@dataclass(frozen=True)
class StifferStops:
    """The walk with all stops that carry much made stiffer, all else solved again.

    Args:
        factor: Times their stiffness.
        status: "converged", or why not.
        changes: What it changes, as `StopVerdict.stiffer`; empty without a solution.
    """

    factor: float
    status: str
    changes: dict[str, float]


@dataclass(frozen=True)
class Verdict:
    """All that is known about an identification.

    Args:
        springs: Every spring that is worn, in the order of `conventions.STIFFNESSES`.
        numbers: Every other number that was free to choose.
        stops: Every hard stop.
        stiffer_stops: The walk with stiffer stops; None where none carries much, or where the
            torque curve would not be exact.
        snapped: The choice among real springs; None where the file lists none.
        optima: Other local optima within `SHARE` of the best.
        starts: Number of starts that converged.
        solves: Problems that were solved for this.
        seconds: Wall seconds it took.
    """

    springs: tuple[NumberVerdict, ...]
    numbers: tuple[NumberVerdict, ...]
    stops: tuple[StopVerdict, ...]
    snapped: SnappedSprings | None
    optima: tuple[LocalOptimum, ...]
    starts: int
    solves: int
    seconds: float
    stiffer_stops: StifferStops | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values; SI units, shares of 1."""
        plain = asdict(self)
        for key in ("springs", "numbers"):
            for entry, number in zip(plain[key], getattr(self, key), strict=True):
                entry["determined"], entry["width"] = number.determined, number.width
        for entry in plain["springs"]:
            entry["spring"], entry["stiffness"] = entry.pop("name"), entry.pop("value")
        return plain


def verdict_of_metrics(metrics: Mapping[str, Any]) -> Verdict | None:
    """Return the verdict that the metrics of a run hold, None without one.

    Raises:
        DataError: If it is not one that `Verdict.as_dict` wrote.
    """
    plain = metrics.get("verdict")
    if plain is None:
        return None
    where, mend = "verdict in metrics.json", "solve again"
    try:
        verdict = TypeAdapter(Verdict).validate_python(_renamed(plain))
    except ValidationError as problem:
        first = problem.errors()[0]
        what = f"{dotted(first['loc'])}: {first['msg'].lower()}"
        raise DataError(what, where=where, mend=mend) from None
    what = _contradiction(verdict)
    if what:
        raise DataError(what, where=where, mend=mend)
    return verdict


def _renamed(plain: Any) -> Any:
    """Return plain values under the names of the fields; what is malformed stays."""
    if not isinstance(plain, dict) or not isinstance(plain.get("springs"), list):
        return plain
    springs = []
    for entry in plain["springs"]:
        if isinstance(entry, dict):
            entry = {"unit": "N m/rad", "label": "", **entry}
            for old, new in (("spring", "name"), ("stiffness", "value")):
                if old in entry:
                    entry[new] = entry.pop(old)
            name = str(entry.get("name"))
            known = measure_of(name).label if name in STIFFNESSES else name
            entry["label"] = entry["label"] or known
        springs.append(entry)
    return {"numbers": [], **plain, "springs": springs}


def _contradiction(verdict: Verdict) -> str:
    """Return what cannot be in a verdict that was read, "" if it is in order."""
    names = {spring.name for spring in verdict.springs}
    snapped = verdict.snapped
    if not names <= set(STIFFNESSES):
        return f"names the spring {min(names - set(STIFFNESSES))}"
    if snapped is not None and not snapped.names.keys() == snapped.stiffness.keys() <= names:
        return "chooses real springs for others than were identified"
    if any(len(optimum.stiffness) < len(names) for optimum in verdict.optima):
        return "holds an optimum that lacks a stiffness"
    for number in (*verdict.springs, *verdict.numbers):
        if number.range[0] > number.range[1] or number.limit not in ("", "lower", "upper"):
            return f"holds a range or a limit of {number.name} that is none"
    return ""
