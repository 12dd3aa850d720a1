"""A verdict in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.config.learnt import Learnt
from pathwalker_cli.conventions import STIFFNESSES, to_degrees
from pathwalker_cli.results.text import angle_words
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.verdict import (
    LOADED,
    SHARE,
    STIFFER,
    NumberVerdict,
    StopVerdict,
    Verdict,
)

_VISIBLE: Final = 0.05
"""Change of a number from which on it is told [its unit, deg]."""

_BEATEN: Final = 1e-3
"""Share of the cost by which real springs must be cheaper than the optimum to say so."""

PRESCRIBED: Final = "prescribed by the config, not identified"

_SOFTER: Final = {"lower": ("softer", -1.0), "upper": ("stiffer", 1.0)}
_WIDTH: Final = "rad wide"
_LESS: Final = {"lower": ("less", -1.0), "upper": ("more", 1.0)}
_TURNED: Final = {"lower": ("towards dorsiflexion", -1.0), "upper": ("towards plantarflexion", 1.0)}


def verdict_lines(
    verdict: Verdict, learnt: Learnt | None = None, folder: str | Path = "RUN"
) -> Iterator[tuple[str, str]]:
    """Yield label and text of every line.

    Args:
        verdict: The verdict.
        learnt: The learnt numbers that the run stands on.
        folder: The run folder.
    """
    for number in (*verdict.springs, *verdict.numbers):
        yield number.label, number_text(number)
    if learnt is not None:
        yield "learnt numbers", learnt_words(learnt, folder)
    reached = [stop for stop in verdict.stops if stop.excess > 0.0]
    yield "hard stops", "; ".join(map(stop_text, reached)) or "none is reached"
    for warning in stop_warnings(verdict):
        yield "", f"WARNING: {warning}"
    if verdict.starts > 1:
        yield "other optima", _optima(verdict)
    else:
        yield "other optima", "not searched for: `starts: 8` looks from several starts"
    yield "real springs", _snapped(verdict)
    yield "verdict", f"{verdict.solves} problems solved around the optimum, {verdict.seconds:.1f} s"


def learnt_words(learnt: Learnt, folder: str | Path) -> str:
    """Return what a verdict on learnt numbers leaves out, and the command that tells it."""
    return (
        f"all of this is for {len(learnt.numbers)} numbers learnt from {learnt.condition} strides; "
        "other sets explain the strides about as well and may want other springs. How far springs, "
        f"speed and crouch spread over them, and what to measure first: {spread_command(folder)}"
    )


def spread_command(folder: str | Path) -> str:
    """Return the command that draws other sets of learnt numbers around a run."""
    return f'pathwalker uncertainty uncertainty-learnt --run {folder} --set "set={{}}"'


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
        # what makes a difference to a hand: a tenth of the number, or a degree
        step = float(np.deg2rad(1.0)) if number.unit == "rad" else 0.1 * abs(number.value)
        saved = -100.0 * sign * number.gradient * step
        yield (
            f"it sits at the {number.limit} limit: {shown(step, _unit(number), second=False)} "
            f"{word} would save about {saved:.2g} % more"
        )
    if not number.certain:
        yield "the ends of this region are not certain: the problems beyond did not converge"


def stop_text(stop: StopVerdict) -> str:
    """Return how far and how long the ankle goes beyond a stop, and what the stop carries."""
    text = (
        f"{stop.side} {stop.stop} stop ({to_degrees(abs(stop.angle)):.1f} deg) exceeded by "
        f"{to_degrees(stop.excess):.1f} deg, {100 * stop.share:.0f} % of the stride"
    )
    if not stop.torque:
        return text
    return f"{text}, by up to {stop.torque:.1f} N m ({100 * stop.carried:.0f} % of the impulse)"


def stop_warnings(verdict: Verdict) -> Iterator[str]:
    """Yield what to know where stops carry much of what the orthoses exert; nothing elsewhere."""
    loaded = [stop for stop in verdict.stops if stop.carried >= LOADED]
    if not loaded:
        return
    shares = ", ".join(f"{s.side} {s.stop} stop {100 * s.carried:.0f} %" for s in loaded)
    yield (
        f"hard stops carry much of what the orthosis exerts in their direction: {shares}; their "
        "stiffness (orthosis.stop_stiffness) decides as that of the springs does: measure it"
    )
    moves = "; ".join(
        f"{stop.side} {stop.stop} stop {_changes(verdict, stop.stiffer)}"
        for stop in loaded
        if stop.stiffer
    )
    if moves:
        yield f"{100 * STIFFER:g} % more stiffness of a stop changes, to first order: {moves}"
    twice = verdict.stiffer_stops
    if twice is not None and twice.status == "converged":
        moved = _changes(verdict, twice.changes)
        yield f"with {twice.factor:g} times the stiffness of these stops, solved again: {moved}"
    elif twice is not None:
        yield f"with {twice.factor:g} times the stiffness of these stops: {twice.status}"


def stop_sentence(verdict: Verdict) -> str:
    """Return the same in a sentence for a page that has the shares elsewhere; "" if none."""
    warnings = list(stop_warnings(verdict))
    if not warnings:
        return ""
    words = (
        "hard stops carry much of what the orthoses exert, so how stiff they are decides as the "
        "springs do: measure it (orthosis.stop_stiffness)"
    )
    return "; ".join([words, *warnings[1:][-1:]])


def _changes(verdict: Verdict, changes: Mapping[str, float]) -> str:
    """Return how the cost moves, then every number and measure that does so visibly."""
    numbers = {number.name: number for number in (*verdict.springs, *verdict.numbers)}
    parts = [f"cost {100 * changes['cost']:+.2g} %"]
    for name, change in changes.items():
        if name in numbers:
            number = numbers[name]
            angle = number.unit == "rad"
            size, unit = (float(to_degrees(change)), "deg") if angle else (change, number.unit)
            if abs(size) >= _VISIBLE:
                parts.append(f"{number.label} {size:+.2g} {unit}")
        elif name != "cost":
            measure = measure_of(name)
            text = measure.text(change, sign=True)
            if float(text):
                parts.append(f"{measure.label} {text} {measure.shown_unit}".rstrip())
    return ", ".join(parts)


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
        values = [k for optimum in verdict.optima if (k := optimum.stiffness[row]) is not None]
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
