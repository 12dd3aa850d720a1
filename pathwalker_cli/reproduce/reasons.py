"""Why results differ from the article's numbers, where that is known, beside the numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pathwalker_cli.evaluation.paper import PaperNumber

__all__ = ["INPUT", "NOT_COMPUTED", "REASONS", "Reason", "reason_for"]

BOUNDS: Final = "the authors' bounds are not published"
INPUT: Final = "an input of the model: the value in the patient's file that comes with PathWalker"


@dataclass(frozen=True)
class Reason:
    """Why numbers of a kind differ.

    Args:
        subjects: Subjects of `paper.NUMBERS` that it is about.
        begin: How the name of the quantity begins.
        text: The reason, one clause or more.
    """

    subjects: tuple[str, ...]
    begin: str
    text: str

    def covers(self, number: PaperNumber) -> bool:
        """Return whether it is about this number."""
        return number.subject in self.subjects and number.quantity.startswith(self.begin)


_PREDICTED: Final = ("mapd-barefoot", "mapd-orthosis", "mapd-ws-orthosis")
_RECORDED: Final = ("recorded-barefoot", "recorded-orthosis")

REASONS: Final = (
    Reason(("healthy",), "max_isometric_torque", INPUT),
    Reason(
        ("patient",),
        "max_isometric_torque_ankle",
        "which peaks entered the table is not said; the ankle's is ill-conditioned",
    ),
    Reason(
        ("patient",),
        "max_isometric_torque",
        "default: filtered motion and other stances; single stances scatter widely",
    ),
    Reason(
        _RECORDED,
        "residual_up",
        "per body mass, printed as N; default counts measured frames only, published also support "
        "that no plate felt",
    ),
    Reason(
        _RECORDED,
        "residual_",
        "per body mass, printed as N and N m; default: filtered motion, measured frames only",
    ),
    Reason(
        ("recorded",),
        "residual_force_limit",
        "largest mean of a trial, per body mass, printed as N; default counts measured frames only",
    ),
    Reason(
        ("recorded",),
        "residual_moment_limit",
        "largest mean of a trial, per body mass, printed as N m; table 3 itself has 0.15",
    ),
    Reason(
        ("recorded",),
        "residual_over_peak_force",
        "largest mean residual of a trial over the mean peak of measured stances; the article "
        "compares 3.3 N/kg with N",
    ),
    Reason(
        ("recorded-barefoot",),
        "largest_deviation",
        "how they were taken is not said; ours: largest standard deviation between strides in the "
        "gait cycle, least and greatest of pelvis, hip, knee, ankle",
    ),
    Reason(
        _RECORDED,
        "ankle_torque_slope",
        "how it was taken is not said; ours: mean over measured stances of least-squares lines",
    ),
    Reason(_RECORDED, "", "ours: all recordings; which ones the article counted is not said"),
    Reason(
        ("ls-barefoot",),
        "rms_one_trial",
        "the right heel of the published fit slides on the ground, ours may not",
    ),
    Reason(
        ("ls-barefoot",),
        "rms_vertical_force",
        "how forces were averaged is not said; the published motion does not give it either",
    ),
    Reason(_PREDICTED, "rms_one_trial", f"to one trial at equal time, as computed there; {BOUNDS}"),
    Reason(_PREDICTED, "rms_vertical_force", f"how forces were averaged is not said; {BOUNDS}"),
    Reason(_PREDICTED, "walking_speed_weight", "an input of the problem"),
    Reason(("mapd-ws-orthosis",), "walking_speed", f"lambda rewards speed; {BOUNDS}"),
    Reason(_PREDICTED, "walking_speed", f"least effort walks as slowly as it may; {BOUNDS}"),
    Reason(_PREDICTED, "seconds_solve", "other solver, transcription and hardware"),
    Reason(
        _PREDICTED,
        "effort_per_distance",
        f"{BOUNDS}; nothing published with the article allows to check it",
    ),
    Reason(_PREDICTED, "ankle_torque_slope", f"how it was taken is not said; {BOUNDS}"),
    Reason(
        ("change",),
        "min_stance_knee_flexion",
        "both knees of the published barefoot gait rest on a bound of 0.6 rad, which makes the "
        "printed change",
    ),
    Reason(_PREDICTED, "", BOUNDS),
)
"""The first reason that covers a number counts."""

NOT_COMPUTED: Final = (
    Reason(
        ("mapd-orthosis",),
        "largest_change_after",
        "not computed: the perturbation analysis is no part of this command",
    ),
    Reason(("literature",), "", "not computed: a number of other works"),
)
"""Numbers for which nothing is computed, and why."""


def reason_for(number: PaperNumber) -> str:
    """Return the known reason for a difference, "" if none is known."""
    return next((reason.text for reason in REASONS if reason.covers(number)), "")
