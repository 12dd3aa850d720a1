"""The configs of a new folder: those that are shipped, with their comments, for another patient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from pathwalker_cli.io.commented_yaml import Entry, entries
from pathwalker_cli.paths import shipped
from pathwalker_cli.starter.comments import commented

__all__ = ["ConfigFile", "config_files"]

_PROBLEM_KEYS: Final = (
    "problem",
    "patient",
    "starts",
    "cost",
    "cost.effort_weight",
    "cost.walking_speed_weight",
    "cost.activation_power",
    "cost.goals",
    "cost.comfort_ranges",
    "bounds",
    "bounds.least_walking_speed",
    "bounds.fallback_speed_ratio",
    "bounds.joint_range_margin",
    "bounds.joint_ranges",
    "bounds.fallback_joint_ranges",
    "bounds.phase_duration",
    "bounds.phase_durations",
    "bounds.distance",
    "bounds.friction",
    "start",
    "start.gait",
    "start.trial",
    "start.condition",
    "start.knee_flexion",
)
"""What is chosen for a child; the numerical choices keep their defaults."""

_SPRING_KEYS: Final = (
    "verdict",
    "bounds.dorsiflexion_stiffness",
    "bounds.plantarflexion_stiffness",
    "bounds.stiffness",
    "start.stiffness",
)
"""What is chosen besides if there are springs."""


@dataclass(frozen=True)
class ConfigFile:
    """One config of a new folder.

    Args:
        name: Its file name.
        purpose: What it is for, the head of the file.
        source: The shipped config whose keys and comments it takes.
        values: Values that differ from the shipped ones, by dotted key.
        only: Keys to take; all if left out.
        idle: Beginning of keys that are written as comments: they wait for something.
    """

    name: str
    purpose: str
    source: str
    values: Mapping[str, str] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    idle: str = ""

    @property
    def partial(self) -> bool:
        """Whether keys of the shipped config are left out."""
        return bool(self.only)

    @property
    def keys(self) -> list[str]:
        """The keys as they are written, each below its comment, with empty lines between them."""
        found = [e for e in entries(shipped("configs") / self.source) if self._taken(e.place)]
        lines = []
        for before, entry in zip([None, *found], found, strict=False):
            first = before is None or entry.parents[:-1] == before.parents
            apart = not first and (entry.comment or len(entry.parents) == 1)
            lines.append("\n" * bool(apart) + self._written(entry))
        return lines

    def _taken(self, place: str) -> bool:
        return not self.only or any(
            place == key or (place.startswith(f"{key}.") and key == "bounds.fallback_joint_ranges")
            for key in self.only
        )

    def _written(self, entry: Entry) -> str:
        depth = len(entry.parents) - 1
        value = self.values.get(entry.place, entry.value)
        idle = bool(self.idle) and entry.place.startswith(self.idle)
        return commented(entry.parents[-1], value, entry.comment, depth, given=not idle)


def config_files(worn: bool) -> tuple[ConfigFile, ...]:
    """Return the configs of a new folder.

    Args:
        worn: Whether there is an orthosis.
    """
    best = "mapd-orthosis.yaml" if worn else "mapd-barefoot.yaml"
    files = [_problem("mapd-barefoot", "Prediction of the barefoot gait of least muscle effort.")]
    if worn:
        files.append(
            _problem(
                "mapd-orthosis",
                "Prediction of the gait with orthoses, and of the springs of least muscle effort.",
                _SPRING_KEYS,
            )
        )
    purposes = _SPRING_STUDIES if worn else {}
    for name, purpose in {**purposes, **_STUDIES}.items():
        files.append(
            ConfigFile(
                f"{name}.yaml",
                purpose,
                f"{name}.yaml",
                {"base": best, **({} if worn else {"check": "[strengths]"})},
                idle="quantities.recorded" if name == "uncertainty" else "",
            )
        )
    return (*files, *_recorded(worn))


_SPRING_STUDIES: Final = {
    "perturbation": "What softer or stiffer springs change: pathwalker perturb.",
    "landscape": "Effort over the springs of a side: pathwalker landscape.",
    "uncertainty": "How far the springs spread if the child's numbers are uncertain: "
    "pathwalker uncertainty. Numbers below `recorded` need recorded gait in patient.yaml: "
    "remove their # then.",
}
_STUDIES: Final = {
    "sensitivity": "What one percent of every number of the child changes: pathwalker sensitivity.",
    "tradeoff": "What walking faster costs: pathwalker tradeoff.",
}


def _problem(name: str, purpose: str, more: tuple[str, ...] = ()) -> ConfigFile:
    file = f"{name}.yaml"
    return ConfigFile(file, purpose, file, {"patient": "patient.yaml"}, (*_PROBLEM_KEYS, *more))


def _recorded(worn: bool) -> tuple[ConfigFile, ...]:
    """Return the configs of recorded gait; C3D files are expected in c3d/."""
    conditions = "[barefoot, orthosis]" if worn else "[barefoot]"
    values = {"patient": "patient.yaml", "conditions": conditions, "c3d.barefoot": "[c3d/barefoot]"}
    if worn:
        values["c3d.orthosis"] = "[c3d/orthosis]"
    return (
        ConfigFile(
            "inverse-kinematics.yaml",
            "Joint angles from the C3D files in c3d/: pathwalker ik.",
            "inverse-kinematics.yaml",
            values,
        ),
        ConfigFile(
            "inverse-dynamics.yaml",
            "Joint torques and strengths from the recordings that pathwalker import has written: "
            "pathwalker id.",
            "inverse-dynamics.yaml",
            values,
        ),
    )
