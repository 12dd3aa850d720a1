"""The configs of a new folder: those that are shipped, with their comments, for another patient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import wrap
from typing import Final

from pathwalker_cli.io.commented_yaml import Entry, entries
from pathwalker_cli.paths import shipped
from pathwalker_cli.starter.seen import Seen

WIDTH: Final = 80
"""Columns of a terminal."""

_TIE: Final = "\u2060"
"""Stands for a space at which no line ends."""


def comment(text: str, depth: int = 0) -> str:
    """Return text as lines of comment, so many levels further in."""
    mark = "  " * depth + "# "
    lines = wrap(text, WIDTH - len(mark), break_on_hyphens=False)
    return "\n".join(mark + line for line in lines).replace(_TIE, " ")


def unbroken(text: str) -> str:
    """Return text that `comment` keeps on one line."""
    return text.replace(" ", _TIE)


def commented(key: str, value: str, text: str, depth: int = 0, given: bool = True) -> str:
    """Return a key with its value, "" for a block, below its comment, so many blocks further in.

    What is not `given` is written as a comment, too.
    """
    mark = "  " * depth + ("" if given else "# ")
    line = f"{mark}{key}: {value}".replace(": \n", ":\n").rstrip()
    return f"{comment(text, depth)}\n{line}" if text else line


_PROBLEM_KEYS: Final = (
    "problem", "patient", "starts",
    "cost", "cost.effort_weight", "cost.walking_speed_weight", "cost.activation_power",
    "cost.goals", "cost.comfort_ranges",
    "bounds", "bounds.least_walking_speed", "bounds.fallback_speed_ratio",
    "bounds.joint_range_margin", "bounds.joint_ranges", "bounds.fallback_joint_ranges",
    "bounds.phase_duration", "bounds.phase_durations", "bounds.distance", "bounds.friction",
    "start", "start.gait", "start.trial", "start.condition", "start.knee_flexion",
)  # fmt: skip
"""What is chosen for a child; the numerical choices keep their defaults."""

_SPRING_KEYS: Final = (
    "verdict", "bounds.dorsiflexion_stiffness", "bounds.plantarflexion_stiffness",
    "bounds.stiffness", "start.stiffness",
)  # fmt: skip
"""What is chosen besides if there are springs."""


@dataclass(frozen=True)
class ConfigFile:
    """One config of a new folder.

    Args:
        stem: Its name, and that of the shipped config whose keys and comments it takes.
        purpose: What it is for, the head of the file.
        values: Values that differ from the shipped ones, by dotted key.
        only: Keys to take; all if left out.
        idle: Beginning of keys that are written as comments: they wait for something.
    """

    stem: str
    purpose: str
    values: Mapping[str, str]
    only: tuple[str, ...] = ()
    idle: str = ""

    @property
    def name(self) -> str:
        """Its file name."""
        return f"{self.stem}.yaml"

    @property
    def keys(self) -> list[str]:
        """The keys as they are written, each below its comment, with empty lines between them."""
        taken = [e for e in entries(shipped("configs") / self.name) if self._takes(e.place)]
        lines = []
        for before, entry in zip([None, *taken], taken, strict=False):
            first = before is None or entry.parents[:-1] == before.parents
            apart = not first and (entry.comment or len(entry.parents) == 1)
            lines.append("\n" * bool(apart) + self._written(entry))
        return lines

    def _takes(self, place: str) -> bool:
        inside = place.startswith("bounds.fallback_joint_ranges.")
        return not self.only or place in self.only or inside or place in self.values

    def _written(self, entry: Entry) -> str:
        depth = len(entry.parents) - 1
        value = self.values.get(entry.place, entry.value)
        idle = bool(self.idle) and entry.place.startswith(self.idle)
        return commented(entry.parents[-1], value, entry.comment, depth, given=not idle)


def config_files(seen: Seen, worn: bool) -> tuple[ConfigFile, ...]:
    """Return the configs of a new folder; C3D files are expected in c3d/.

    If `worn`, walks with an orthosis are among them.
    """
    with_orthosis = seen.with_orthosis
    patient = {"patient": "patient.yaml"}
    recorded = {**patient, "conditions": "[barefoot]", "c3d.barefoot": "[c3d/barefoot]"}
    base, studies = {"base": "mapd-barefoot.yaml", "check": "[strengths]"}, _STUDIES
    if worn:
        recorded |= {"conditions": "[barefoot, orthosis]", "c3d.orthosis": "[c3d/orthosis]"}
    if with_orthosis:
        base, studies = {"base": "mapd-orthosis.yaml"}, {**_SPRING_STUDIES, **_STUDIES}
    problems = _PROBLEMS if with_orthosis else _PROBLEMS[:1]
    return (
        *(
            ConfigFile(name, purpose, patient | seen.config_values(name == "mapd-orthosis"), keys)
            for name, purpose, keys in problems
        ),
        *(
            ConfigFile(name, purpose, base, idle="quantities.recorded" * (name == "uncertainty"))
            for name, purpose in studies.items()
        ),
        *(ConfigFile(name, purpose, recorded) for name, purpose in _RECORDED.items()),
    )


_PROBLEMS: Final = (
    ("mapd-barefoot", "Prediction of the barefoot gait of least muscle effort.", _PROBLEM_KEYS),
    (
        "mapd-orthosis",
        "Prediction of the gait with orthoses, and of the springs of least muscle effort.",
        (*_PROBLEM_KEYS, *_SPRING_KEYS),
    ),
)
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
_RECORDED: Final = {
    "inverse-kinematics": "Joint angles from the C3D files in c3d/: pathwalker ik.",
    "inverse-dynamics": "Joint torques and strengths from the recordings that pathwalker import "
    "has written: pathwalker id.",
}
