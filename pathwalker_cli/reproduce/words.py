"""Numbers and names of the page as text, in the units in which the article prints them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from pathwalker_cli.conventions import to_degrees
from pathwalker_cli.evaluation.evaluate import compared
from pathwalker_cli.evaluation.paper import PaperNumber
from pathwalker_cli.reproduce.comparison import Ours, Row

_FACTOR: Final = {"deg": float(to_degrees(1.0)), "%": 100.0, "h": 1.0 / 3600.0}
"""From SI units to those of the article."""

_LEAST_DIGITS: Final = {"m": 3, "m/s": 3, "s/m": 3, "N/kg": 2, "N m/kg": 2}
"""Digits after the point that we show at least, where the article truncates to fewer."""

SUBJECTS: Final = {
    "ls-barefoot": "LS-Barefoot",
    "mapd-barefoot": "MAPD-Barefoot",
    "mapd-orthosis": "MAPD-Orthosis",
    "mapd-ws-orthosis": "MAPD-WS-Orthosis",
    "mapd-healthy": "MAPD-Healthy",
    "recorded-barefoot": "recorded barefoot",
    "recorded-orthosis": "recorded with orthoses",
    "recorded": "recorded, all trials",
    "change": "barefoot to orthosis",
    "healthy": "healthy child",
    "patient": "patient",
    "literature": "earlier predictions of others",
}
"""What numbers are about, in words: problems and recordings."""

_QUANTITIES: Final = {measure.key: measure.row for measure in compared()} | {
    "min_stance_knee_flexion_left": "least knee flexion of stance, left",
    "min_stance_knee_flexion_right": "least knee flexion of stance, right",
    "rms_vertical_force_stance": "vertical ground force, RMS difference",
    "ankle_torque_slope_stance_left": "slope of net ankle torque over angle in stance, left",
    "ankle_torque_slope_stance_right": "slope of net ankle torque over angle in stance, right",
    "seconds_solve": "time of the solve",
    "walking_speed_weight": "lambda of equation (10)",
    "residual_force_limit": "residual forces stay under",
    "residual_moment_limit": "residual moments stay under",
    "residual_over_peak_force": "residuals over peak ground force",
    "largest_deviation": "largest deviations between strides",
    "largest_change_after_-5%": "largest change after a spring is 5 % softer",
    "vertical_force_deviation": "deviation of vertical forces, of body weight",
}

_SIDE: Final = re.compile(r"_([lr])$")


def subject(number: PaperNumber) -> str:
    """Return what a number is about, in words."""
    return SUBJECTS[number.subject]


def label(number: PaperNumber) -> str:
    """Return the name of a quantity in words."""
    name = number.quantity
    if name.startswith("rms_one_trial_"):
        return f"{name.removeprefix('rms_one_trial_')} angle, RMS difference"
    if name in _QUANTITIES:
        return _QUANTITIES[name]
    stem = _SIDE.sub(lambda m: {"l": ", left", "r": ", right"}[m[1]], name)
    for prefix in ("max_isometric_torque_", "residual_"):
        stem = stem.removeprefix(prefix)
    return stem.replace("_", " ")


def printed(number: PaperNumber) -> str:
    """Return the article's number as printed, with its unit."""
    text = str(number) if not number.upper else f"{number.text} to {number.upper}"
    return f"{text} {number.unit}".strip()


def ours_text(row: Row) -> str:
    """Return our number in the article's unit, or why there is none."""
    if isinstance(row.ours, str):
        return row.ours
    number, ours = row.number, row.ours
    if number.unit == "h":
        return f"{ours.value:.0f} s"
    if ours.low is None or ours.high is None:
        return _shown(ours.value, number)
    low, high = _shown(ours.low, number), _shown(ours.high, number)
    return f"{low} to {high}" if number.upper else f"{_shown(ours.value, number)} ({low} to {high})"


def deviation(row: Row) -> str:
    """Return how ours differs from the article's number, "-" without ours."""
    if isinstance(row.ours, str):
        return "-"
    number, ours = row.number, row.ours
    low, high = number.bounds
    if number.upper and ours.low is not None and ours.high is not None:
        ends = (_shown(ours.low - low, number, "+"), _shown(ours.high - high, number, "+"))
        return f"ends {ends[0]} and {ends[1]}"
    if number.upper:
        return _beside_range(row, ours, low, high)
    if row.agrees:
        return "as printed"
    if number.unit == "h":
        return f"1/{low / ours.value:.0f} of it" if ours.value else "-"
    near_zero = number.quantity.startswith("residual_") or number.subject == "change" or not low
    share = "" if near_zero else f" ({(ours.value - low) / abs(low):+.0%})".replace("%", " %")
    return f"{_shown(ours.value - low, number, '+')}{share}"


def _beside_range(row: Row, ours: Ours, low: float, high: float) -> str:
    """Return where a value lies in relation to a printed range."""
    if row.agrees:
        return "inside"
    if ours.value < low:
        return f"{_shown(low - ours.value, row.number)} below"
    return f"{_shown(ours.value - high, row.number)} above"


def _shown(value: float, number: PaperNumber, sign: str = "") -> str:
    """Return a value in SI units in the unit of the article and with its digits."""
    shown = _FACTOR.get(number.unit, 1.0) * value
    digits = max(len(number.text.partition(".")[2]), _LEAST_DIGITS.get(number.unit, 0))
    text = f"{shown:{sign}.{digits}f}"
    return text.replace("-", "", 1) if float(text) == 0.0 and not sign else text


def degrees(value: float | None) -> str:
    """Return an angle in degrees, "-" for none."""
    return "-" if value is None else f"{float(to_degrees(value)):.1f}"


def plain(value: float | None, form: str) -> str:
    """Return a number in a format, "-" for none."""
    return "-" if value is None else format(value, form)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    cells = [head, ["---"] * len(head), *rows]
    return [f"| {' | '.join(text.replace('|', '/') for text in row)} |" for row in cells]
