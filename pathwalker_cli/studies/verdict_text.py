"""The verdict on an identification in plain language."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from pathwalker_cli.conventions import STIFFNESSES, to_degrees
from pathwalker_cli.results.text import angle_words
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.verdict import SHARE, NumberVerdict, StopVerdict, Verdict

__all__ = [
    "PRESCRIBED",
    "number_text",
    "per_degree",
    "reservations",
    "snapped_warning",
    "stop_text",
    "verdict_lines",
]

_BEATEN: Final = 1e-3
"""Share of the cost by which real springs must be cheaper than the optimum to say so."""

PRESCRIBED: Final = "prescribed by the config, not identified"

_SOFTER: Final = {"lower": ("softer", -1.0), "upper": ("stiffer", 1.0)}
_WIDTH: Final = "rad wide"
_LESS: Final = {"lower": ("less", -1.0), "upper": ("more", 1.0)}
_TURNED: Final = {"lower": ("towards dorsiflexion", -1.0), "upper": ("towards plantarflexion", 1.0)}


def verdict_lines(verdict: Verdict) -> Iterator[tuple[str, str]]:
    """Yield label and text of every line."""
    for number in (*verdict.springs, *verdict.numbers):
        yield number.label, number_text(number)
    reached = [stop for stop in verdict.stops if stop.excess > 0.0]
    yield "hard stops", "; ".join(map(stop_text, reached)) or "none is reached"
    if verdict.starts > 1:
        yield "other optima", _optima(verdict)
    else:
        yield "other optima", "not searched for: `starts: 8` looks from several starts"
    yield "real springs", _snapped(verdict)
    yield "verdict", f"{verdict.solves} problems solved around the optimum, {verdict.seconds:.1f} s"


def per_degree(stiffness: float) -> float:
    """Return a stiffness in N m/deg from N m/rad."""
    return float(np.deg2rad(stiffness))


def shown(value: float, unit: str, second: bool = True) -> str:
    """Return a number in the units in which people have it: angles in degrees.

    Args:
        value: The number [unit].
        unit: SI unit, see `_unit`; an angle is one of the ankle, + = plantarflexion.
        second: Whether a stiffness is also given per degree, an angle with its direction.
    """
    if unit == _WIDTH:
        return f"{float(to_degrees(value)):.1f} deg"
    if unit == "rad":
        return angle_words(value) if second else f"{float(to_degrees(abs(value))):.1f} deg"
    if unit == "N m/rad":
        each = f" ({per_degree(value):.2f} N m/deg)" if second else ""
        return f"{value:.1f} N m/rad{each}"
    return f"{value:.3g} {unit}"


def _unit(number: NumberVerdict) -> str:
    """Return the unit of a number, that of a width where it is an angle without direction."""
    return _WIDTH if number.name.startswith("free_play") else number.unit


def _span(low: float, high: float, unit: str) -> str:
    """Return a range like `shown`."""
    if unit in ("rad", _WIDTH):
        return f"{shown(low, unit)} to {shown(high, unit)}"
    if unit == "N m/rad":
        return (
            f"{low:.1f} to {high:.1f} N m/rad ({per_degree(low):.2f} to {per_degree(high):.2f} "
            "N m/deg)"
        )
    return f"{low:.3g} to {high:.3g} {unit}"


def number_text(number: NumberVerdict) -> str:
    """Return what is known of a number."""
    unit = _unit(number)
    value = shown(number.value, unit)
    if number.prescribed:
        return f"{value}: {PRESCRIBED}"
    what = "springs that are" if number.unit == "N m/rad" else "range that is"
    text = (
        f"{value}: {number.determined}; the cost stays within {100 * SHARE:g} % of the best from "
        f"{_span(*number.region, unit)}, {100 * number.width:.0f} % of the {what} allowed"
    )
    both = ["both sides are one number"] if number.tied else []
    return "; ".join([text, *both, *reservations(number)])


def reservations(number: NumberVerdict) -> Iterator[str]:
    """Yield what to know of a number beside its region: other optima, limits, doubts."""
    if number.prescribed:
        return
    far = [end for end, again in zip(number.range, number.again, strict=True) if again]
    if far:
        ends = " and ".join(shown(end, _unit(number), number.unit == "rad") for end in far)
        ends = ends.replace(" N m/rad and", " and")
        yield f"the cost is as good again at {ends}, another local optimum"
    if number.limit:
        words = {"N m/rad": _SOFTER, "rad": _TURNED}
        word, sign = words.get(_unit(number), _LESS)[number.limit]
        step = _noticeable(number)
        saved = -100.0 * sign * number.gradient * step
        yield (
            f"it sits at the {number.limit} limit: {shown(step, _unit(number), second=False)} "
            f"{word} would save about {saved:.2g} % more"
        )
    if not number.certain:
        yield "the ends of this region are not certain: the problems beyond did not converge"


def _noticeable(number: NumberVerdict) -> float:
    """Return a step that makes a difference to a hand: a tenth of the number, or a degree."""
    return float(np.deg2rad(1.0)) if number.unit == "rad" else 0.1 * abs(number.value)


def stop_text(stop: StopVerdict) -> str:
    """Return how far and how long the ankle goes beyond a stop."""
    return (
        f"{stop.side} {stop.stop} stop ({to_degrees(abs(stop.angle)):.1f} deg) exceeded by "
        f"{to_degrees(stop.excess):.1f} deg, {100 * stop.share:.0f} % of the stride"
    )


def _optima(verdict: Verdict) -> str:
    others = verdict.optima[1:]
    text = f"{len(others)} of {verdict.starts - 1} other starts end within {100 * SHARE:g} %"
    if not others:
        return text
    spread = []
    for spring in verdict.springs:
        if spring.prescribed:
            continue
        row = STIFFNESSES.index(spring.name)
        values = [optimum.stiffness[row] for optimum in verdict.optima]
        spread.append(f"{measure_of(spring.name).label} {min(values):.0f} to {max(values):.0f}")
    return f"{text}, with {', '.join(spread)} N m/rad"


def snapped_warning(verdict: Verdict) -> str:
    """Return what to beware of with the real springs; "" where there is nothing.

    They may cost less than the optimum, which is then not the best one, or far more.
    """
    snapped = verdict.snapped
    if snapped is None:
        return ""
    if snapped.status == "converged" and snapped.rise <= -_BEATEN:
        return (
            "WARNING: that is less than the optimum found, which is therefore not the best one; "
            "`starts: 8` looks for better ones"
        )
    if snapped.rise > SHARE:
        return (
            f"WARNING: {100 * snapped.rise:.2g} % above the springs found, to which all figures "
            "belong; none that is listed and allowed comes near: prescribe these and solve again"
        )
    return ""


def _snapped(verdict: Verdict) -> str:
    snapped = verdict.snapped
    if snapped is None:
        return "the patient's file lists none (orthosis.springs)"
    chosen = ", ".join(
        f"{measure_of(name).label} {snapped.names[name]} ({stiffness:.1f} N m/rad, "
        f"{per_degree(stiffness):.2f} N m/deg)"
        for name, stiffness in snapped.stiffness.items()
    )
    text = f"{chosen}: cost {100 * snapped.rise:+.2g} %, {snapped.walking_speed:.3f} m/s"
    if snapped.status != "converged":
        rise = f"{100 * snapped.rise:+.2g} %"
        text = f"{chosen}: estimated cost {rise} (solving it: {snapped.status})"
    return "; ".join(filter(None, (text, snapped_warning(verdict))))
