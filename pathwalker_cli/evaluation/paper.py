"""The numbers of the article as it prints them, with the place where each stands.

The article truncates where others round: a walking speed of 0.6098 m/s is printed as 0.60.

References:
    Sreenivasa M, Millard M, Felis M, Mombaur K, Wolf SI (2017). Frontiers in Computational
    Neuroscience 11:23, doi 10.3389/fncom.2017.00023.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import Condition

PATIENT: Final = "sreenivasa2017-patient"
"""Id of the patient whom the article is about."""

_TO_SI: Final = {"deg": np.pi / 180.0, "%": 0.01, "h": 3600.0}


@dataclass(frozen=True)
class PaperNumber:
    """A number, or a range, that the article prints.

    Args:
        subject: What it is about: a problem ("mapd-barefoot"), "recorded-barefoot" or
            "recorded-orthosis", "change" (from barefoot to orthosis), "patient" or "healthy".
        quantity: Name of the quantity; those of a gait are the keys of its measures.
        text: The digits as printed; the lower end of a range.
        unit: Unit as printed.
        place: Where in the article.
        upper: Upper end of a range as printed, "" for a single number.
        note: What to know about it, "" if nothing.
    """

    subject: str
    quantity: str
    text: str
    unit: str
    place: str
    upper: str = ""
    note: str = ""

    def __str__(self) -> str:
        """Return the digits as printed."""
        return f"{self.text}-{self.upper}" if self.upper else self.text

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest value in SI units; the same twice for a single number."""
        factor = _TO_SI.get(self.unit, 1.0)
        return factor * float(self.text), factor * float(self.upper or self.text)

    @property
    def value(self) -> float:
        """The value in SI units, radians and shares; the middle of a range."""
        return sum(self.bounds) / 2.0

    @property
    def step(self) -> float:
        """One unit of the last printed digit, in SI units."""
        digits = len(self.text.partition(".")[2])
        return float(10.0**-digits) * _TO_SI.get(self.unit, 1.0)

    def agrees(self, value: float) -> bool:
        """Return whether a value [SI], truncated or rounded, prints as this number or within it."""
        low, high = self.bounds
        rounding = 1e-9 * self.step
        if self.upper:
            return low - self.step / 2.0 <= value <= high + self.step
        further = np.sign(low or value) * (value - low)
        return bool(-self.step / 2.0 - rounding <= further < self.step)


@dataclass(frozen=True)
class PaperClaim:
    """A change from barefoot to orthosis that the article states in words, and where.

    The quantity is the key of a measure, without the side.
    """

    quantity: str
    rises: bool
    place: str

    def __str__(self) -> str:
        """Return the claim as one word."""
        return "rises" if self.rises else "falls"


@dataclass(frozen=True)
class ReferenceRows:
    """The stride that the article's programs compared with: rows of one recorded trial."""

    trial: str
    first: int
    last: int


REFERENCE_STRIDES: Final[dict[Condition, ReferenceRows]] = {
    "barefoot": ReferenceRows("3053171", 246, 361),
    "orthosis": ReferenceRows("3053141", 25, 135),
}
"""Found by comparison of the published reference files with the recordings: equal to 1e-3 deg."""

_SIDES: Final = ("left", "right")
_RESULTS: Final = "section 3"


def _per_side(
    subject: str, stem: str, texts: str, unit: str, place: str, note: str = ""
) -> Iterator[PaperNumber]:
    """Return the numbers of the left and the right side, "low-high" for ranges."""
    for side, text in zip(_SIDES, texts.split(), strict=True):
        low, _, high = text.partition("..")
        yield PaperNumber(subject, f"{stem}_{side}", low, unit, place, high, note)


def _table_1() -> Iterator[PaperNumber]:
    """Return the maximum isometric torques: healthy left, right, patient left, right."""
    legs = {
        "hip_extension": "48.82 48.82 30.35 18.64",
        "hip_flexion": "34.27 34.27 21.31 13.08",
        "knee_extension": "36.08 36.08 24.55 22.40",
        "knee_flexion": "19.26 19.26 13.10 11.95",
        "ankle_extension": "39.46 39.46 16.84 32.32",
        "ankle_flexion": "13.71 13.71 5.85 11.23",
    }
    cells = [(who, side) for who in ("healthy", "patient") for side in ("l", "r")]
    for name, texts in legs.items():
        for (who, side), text in zip(cells, texts.split(), strict=True):
            yield PaperNumber(who, f"max_isometric_torque_{name}_{side}", text, "N m", "table 1")
    for name, texts in {"lumbar_extension": "48.82 24.49", "lumbar_flexion": "34.27 17.19"}.items():
        for who, text in zip(("healthy", "patient"), texts.split(), strict=True):
            yield PaperNumber(who, f"max_isometric_torque_{name}", text, "N m", "table 1")


def _table_3() -> Iterator[PaperNumber]:
    """Return the pelvis residuals: mean, lowest and highest trial."""
    rows = {
        ("recorded-barefoot", "forward"): "-0.02 -0.27 0.16",
        ("recorded-barefoot", "up"): "1.36 -0.04 2.8",
        ("recorded-barefoot", "moment"): "-0.02 -0.11 0.09",
        ("recorded-orthosis", "forward"): "-0.05 -0.16 0.01",
        ("recorded-orthosis", "up"): "1.6 0.0 3.28",
        ("recorded-orthosis", "moment"): "-0.05 -0.15 0.11",
    }
    for (subject, part), texts in rows.items():
        printed, true = ("N m", "N m/kg") if part == "moment" else ("N", "N/kg")
        note = f"printed as {printed}; the numbers are {true} of body mass"
        for kind, text in zip(("mean", "min", "max"), texts.split(), strict=True):
            yield PaperNumber(subject, f"residual_{part}_{kind}", text, true, "table 3", note=note)


def _table_4() -> Iterator[PaperNumber]:
    """Return step lengths and walking speeds."""
    rows = {
        "recorded-barefoot": ("0.30..0.43 0.22..0.37", "0.51", "0.73"),
        "mapd-barefoot": ("0.37 0.29", "0.60", ""),
        "recorded-orthosis": ("0.40..0.47 0.34..0.46", "0.70", "0.98"),
        "mapd-orthosis": ("0.32 0.41", "0.62", ""),
    }
    for subject, (steps, low, high) in rows.items():
        yield from _per_side(subject, "step_length", steps, "m", "table 4")
        yield PaperNumber(subject, "walking_speed", low, "m/s", "table 4", high)


def _table_5() -> Iterator[PaperNumber]:
    """Return the changes of the MAPD-Orthosis result with a spring that is 5 % softer."""
    columns = (
        "cost",
        "min_stance_knee_flexion_left",
        "min_stance_knee_flexion_right",
        "step_length_left",
        "step_length_right",
        "walking_speed",
    )
    rows = {
        "dorsiflexion_stiffness_left": "1.75 -0.32 -1.14 0.30 0.35 -0.002",
        "plantarflexion_stiffness_left": "1.10 -0.65 -0.11 -0.26 0.68 0.39",
        "dorsiflexion_stiffness_right": "0.11 0.08 -1.39 0.03 0.27 -0.06",
        "plantarflexion_stiffness_right": "0.67 -1.02 0.87 0.09 0.89 0.56",
    }
    for spring, texts in rows.items():
        for column, text in zip(columns, texts.split(), strict=True):
            quantity = f"{column}_after_-5%_{spring}"
            yield PaperNumber("mapd-orthosis", quantity, text, "%", "table 5")


def _differences() -> Iterator[PaperNumber]:
    """Return the RMS differences between results and recordings."""
    note = "said to be against the average recorded gait; computed against one trial at equal time"
    unknown = "how forces were averaged over trials is not said"
    angles = {
        "ls-barefoot": "0.83 1.52 2.43 2.64",
        "mapd-barefoot": "7.57 12.95 13.67 12.22",
        "mapd-orthosis": "8.48 14.48 16.11 8.28",
    }
    for subject, texts in angles.items():
        for joint, text in zip(("pelvis", "hip", "knee", "ankle"), texts.split(), strict=True):
            yield PaperNumber(subject, f"rms_one_trial_{joint}", text, "deg", _RESULTS, note=note)
    forces = {"ls-barefoot": "68.24", "mapd-barefoot": "81.1", "mapd-orthosis": "128.04"}
    for subject, text in forces.items():
        quantity = "rms_vertical_force_stance"
        yield PaperNumber(subject, quantity, text, "N", _RESULTS, note=unknown)


def _results() -> Iterator[PaperNumber]:
    """Return every other number of the results section, and of the discussion of forces."""
    yield PaperNumber("recorded", "residual_force_limit", "3.3", "N/kg", _RESULTS,
                      note="printed as N; per body mass as in table 3")  # fmt: skip
    yield PaperNumber("recorded", "residual_moment_limit", "0.12", "N m/kg", _RESULTS,
                      note="printed as N m; table 3 has 0.15")  # fmt: skip
    yield PaperNumber("recorded-barefoot", "largest_deviation", "5.5", "deg", _RESULTS, "13.34",
                      "called maximum variances; how they were computed is not said")  # fmt: skip
    yield from _per_side("change", "min_stance_knee_flexion", "-8.3 -9.26", "deg", _RESULTS,
                         "printed without sign, as knees that extend more")  # fmt: skip
    for subject, cost in (("mapd-barefoot", "2.2"), ("mapd-orthosis", "0.61")):
        yield PaperNumber(subject, "effort_per_distance", cost, "s/m", _RESULTS)
    for subject, hours in (("mapd-barefoot", "4"), ("mapd-orthosis", "7")):
        yield PaperNumber(subject, "seconds_solve", hours, "h", _RESULTS,
                          note="one thread of a 3.6 GHz processor")  # fmt: skip
    yield from _per_side(
        "mapd-orthosis", "dorsiflexion_stiffness", "62.8 45.9", "N m/rad", _RESULTS
    )
    yield from _per_side("mapd-orthosis", "plantarflexion_stiffness", "19.7 13.2", "N m/rad",
                         _RESULTS)  # fmt: skip
    yield PaperNumber("mapd-ws-orthosis", "walking_speed", "0.77", "m/s", _RESULTS)
    yield PaperNumber("mapd-ws-orthosis", "walking_speed_weight", "2", "", _RESULTS)
    slopes = {"recorded-orthosis": ("95.7", "135.5"), "mapd-orthosis": ("122.3", "150.1")}
    for subject, (low, high) in slopes.items():
        for side in _SIDES:
            yield PaperNumber(subject, f"ankle_torque_slope_stance_{side}", low, "N m/rad",
                              f"{_RESULTS}, figure 7", high,
                              "over both sides; how the slope was taken is not said")  # fmt: skip
    yield PaperNumber("mapd-orthosis", "largest_change_after_-5%", "1.75", "%", _RESULTS)
    yield PaperNumber("recorded", "residual_over_peak_force", "1.0", "%", "section 4")
    yield PaperNumber("literature", "vertical_force_deviation", "150", "%", "section 4", "200",
                      "of body weight, in earlier predictions")  # fmt: skip


NUMBERS: Final = (*_table_1(), *_table_3(), *_table_4(), *_table_5(), *_differences(), *_results())
"""Tables 1, 3, 4 and 5 and every number of the results section."""

CLAIMS: Final = (
    PaperClaim("walking_speed", True, _RESULTS),
    PaperClaim("step_length_right", True, _RESULTS),
    PaperClaim("min_stance_knee_flexion", False, _RESULTS),
    PaperClaim("effort_per_distance", False, _RESULTS),
    PaperClaim("peak_ankle_extension_torque", False, f"{_RESULTS}, figure 5"),
    PaperClaim("mean_ankle_extension_torque", False, f"{_RESULTS}, figure 5"),
    PaperClaim("peak_ankle_extension_activation", False, f"{_RESULTS}, figure 6"),
    PaperClaim("mean_ankle_extension_activation", False, f"{_RESULTS}, figure 6"),
)
"""What the article says that the orthosis changes, in words or by two printed numbers."""


def paper_number(subject: str, quantity: str) -> PaperNumber | None:
    """Return what the article prints for a quantity of a subject, or None."""
    found = (n for n in NUMBERS if (n.subject, n.quantity) == (subject, quantity))
    return next(found, None)


def paper_claim(quantity: str) -> PaperClaim | None:
    """Return how the article says that a quantity changes with the orthosis, or None."""
    stem = quantity.removesuffix("_right").removesuffix("_left")
    return next((claim for claim in CLAIMS if claim.quantity in (quantity, stem)), None)
