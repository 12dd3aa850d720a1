"""The problems that can be solved, as values: who walks, what is sought, what is set by default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from pathwalker_cli.conventions import Condition
from pathwalker_cli.errors import ConfigError, did_you_mean


@dataclass(frozen=True)
class Problem:
    """One of the problems of Sreenivasa et al. (2017), section 2.3.

    Args:
        name: Its name in configs and on the command line.
        condition: Walking condition that it is about.
        goal: "effort": predict a periodic gait, equations (9) and (10); "fit": follow a recorded
            passage, equation (8).
        defaults: Config values that belong to it, where the config is silent.
    """

    name: str
    condition: Condition
    goal: Literal["effort", "fit"] = "effort"
    defaults: Mapping[str, Any] = field(default_factory=dict)


_FIT: Final = {
    "cost": {"effort_weight": 0.0, "rate_weight": 0.0, "acceleration_weight": 0.0},
    "bounds": {"least_walking_speed": 0.0, "joint_range_margin": 0.5},
    "start": {"gait": "recorded"},
}

PROBLEMS: Final = {
    problem.name: problem
    for problem in (
        Problem("ls-barefoot", "barefoot", "fit", _FIT),
        Problem("mapd-barefoot", "barefoot", defaults={"bounds": {"joint_range_margin": 0.0}}),
        Problem("mapd-orthosis", "orthosis"),
        Problem("mapd-ws-orthosis", "orthosis", defaults={"cost": {"walking_speed_weight": 2.0}}),
        Problem("mapd-healthy", "barefoot", defaults={"half_cycle": True}),
    )
}


def problem_named(name: str) -> Problem:
    """Return a problem.

    Raises:
        ConfigError: If there is no such problem.
    """
    if name not in PROBLEMS:
        raise ConfigError(
            f"there is no problem '{name}'",
            allowed=", ".join(PROBLEMS),
            mend=did_you_mean(name, PROBLEMS),
        )
    return PROBLEMS[name]
