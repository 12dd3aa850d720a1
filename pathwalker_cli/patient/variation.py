"""A patient who differs from the file: numbers scaled or shifted by their place in it.

One way in for everything that asks "what if": cohorts, sensitivities and uncertainty studies.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from operator import add, mul
from typing import Annotated, Any, Final

from pydantic import Field

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import ConfigError, PatientError, did_you_mean
from pathwalker_cli.io.fields import Quantity, YamlModel
from pathwalker_cli.io.yaml_file import validate
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import SegmentLengths

_IDENTITY: Final = frozenset({"id", "description", "sex", "age_for_regressions_reason", "sides"})
"""Keys of a patient's file that hold no number."""

_LISTED: Final = 5
"""Numbers of a config that are told one by one."""

Factor = Annotated[float, Quantity("", 0.01, 100.0)]
Shift = Annotated[float, Quantity("SI units", -1e6, 1e6)]


class Variation(YamlModel):
    """How the patient of a study differs from the patient's file.

    Keys are dotted places in the file, e.g. "strengths.knee_extension.right", "body_mass",
    "segment_lengths.thigh" or "orthosis.neutral_angle"; what stands below a place changes with
    it.  Factors come first, then shifts in SI units.
    """

    scale: dict[str, Factor] = Field(default_factory=dict)
    shift: dict[str, Shift] = Field(default_factory=dict)

    def merged(self, other: Variation) -> Variation:
        """Return both variations as one: factors multiply, shifts add up."""
        scale, shift = dict(self.scale), dict(self.shift)
        for place, factor in other.scale.items():
            scale[place] = scale.get(place, 1.0) * factor
        for place, amount in other.shift.items():
            shift[place] = shift.get(place, 0.0) + amount
        return Variation(scale=scale, shift=shift)


def varied(
    patient: Patient, variation: Variation, numbers: Mapping[str, float] | None = None
) -> Patient:
    """Return a patient with some numbers changed.

    Lengths that the file leaves to body proportions are filled in before they are changed; named
    numbers, by address, come first.

    Raises:
        ConfigError: If a place does not exist or holds no number.
        PatientError: If the patient that results is refused.
    """
    if not variation.scale and not variation.shift and not numbers:
        return patient
    content = _filled_in(patient, (*variation.scale, *variation.shift))
    for address, value in (numbers or {}).items():
        _put(content, address, value)
    for place, factor in variation.scale.items():
        _change(content, f"variation.scale.{place}", place, partial(mul, factor))
    for place, amount in variation.shift.items():
        _change(content, f"variation.shift.{place}", place, partial(add, amount))
    changed = validate(
        content, Patient, where=f"{patient.id} with its variation", error=PatientError
    )
    notes = [f"{place} = {value:g}" for place, value in (numbers or {}).items()]
    if len(notes) > _LISTED:
        notes = [f"{len(notes)} numbers of the config, learnt or given"]
    notes += [f"{place} x {factor:g}" for place, factor in variation.scale.items()]
    notes += [f"{place} {amount:+g}" for place, amount in variation.shift.items()]
    changed._origin = patient._origin
    differs = f"differs from the patient's file: {', '.join(notes)}"
    changed._changes = (*patient.filled_in, *patient._changes, differs)
    return changed


def _filled_in(patient: Patient, places: Collection[str]) -> dict[str, Any]:
    """Return the content of a patient's file with all lengths written out.

    Of the orthosis, what is at none of the places that are to be changed stays left out.
    """
    content: dict[str, Any] = patient.model_dump(mode="json")
    lengths, points = content["segment_lengths"], content["contact_points"]
    for name in SegmentLengths.model_fields:
        if lengths[name] is None:
            lengths[name] = patient.length(name, "right")
    if points["barefoot"] is None:
        points["barefoot"] = patient.contacts("barefoot").model_dump(mode="json")
    worn, still = content["orthosis"], dict.fromkeys(patient.braced("orthosis"), 0.0)
    follows: dict[str, Any] = {
        "cuff_height": {side: patient.cuff_height(side) for side in still},
        "cuff_area": {side: patient.cuff_area(side) for side in still},
        "hinge": {"forward": dict(still), "up": dict(still)},
    }
    for name, value in follows.items():
        if worn and worn[name] is None and any(p.startswith(f"orthosis.{name}") for p in places):
            worn[name] = value
    return {key: value for key, value in content.items() if value is not None}


def _put(content: dict[str, Any], address: str, value: float) -> None:
    """Put a number in the place that the file has for it, else among its further numbers."""
    *parents, last = address.split(".")
    holder: Any = content
    for part in parents:
        below = holder.get(part) if isinstance(holder, dict) else None
        if last in SIDES and isinstance(below, int | float):
            below = holder[part] = dict.fromkeys(SIDES, below)
        holder = below
    if isinstance(holder, dict) and last in holder:
        holder[last] = value
    else:
        content["numbers"][address] = value


def _change(
    content: dict[str, Any], where: str, place: str, change: Callable[[float], float]
) -> None:
    """Change every number at and below a place, or a further number of this address."""
    if place in content["numbers"]:
        content["numbers"][place] = change(content["numbers"][place])
        return
    *parents, last = place.split(".")
    holder: Any = content
    for depth, part in enumerate(parents):
        holder = _below(holder, part, where, ".".join(parents[:depth]))
    if not _holds_number(_below(holder, last, where, ".".join(parents))):
        what = "is not given for this patient" if holder[last] is None else "holds no number"
        raise ConfigError(what, where=where, allowed="the place of a number")
    holder[last] = _mapped(holder[last], change)


def _below(holder: Any, part: str, where: str, above: str) -> Any:
    """Return what stands at a key.

    Raises:
        ConfigError: If there is no such key.
    """
    known = [key for key in holder if key not in _IDENTITY] if isinstance(holder, dict) else []
    if part in known:
        return holder[part]
    raise ConfigError(
        f"the patient's file has no '{part}'" + (f" in {above}" if above else ""),
        where=where,
        allowed=", ".join(known) or f"nothing below {above}, which is one number",
        mend=did_you_mean(part, known),
    )


def _mapped(value: Any, change: Callable[[float], float]) -> Any:
    """Return a value with all numbers in it changed."""
    if isinstance(value, Mapping):
        return {key: _mapped(entry, change) for key, entry in value.items()}
    if isinstance(value, list):
        return [_mapped(entry, change) for entry in value]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return change(float(value))
    return value


def _holds_number(value: Any) -> bool:
    """Return whether there is a number in a value."""
    if isinstance(value, Mapping):
        return any(map(_holds_number, value.values()))
    if isinstance(value, list):
        return any(map(_holds_number, value))
    return isinstance(value, int | float) and not isinstance(value, bool)
