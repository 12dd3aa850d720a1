"""The trials of a study of recorded gait, read back from its folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pathwalker_cli.conventions import Condition, Side
from pathwalker_cli.inverse.cycles import Stance, gait_cycles
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.io.recordings import names_in, read_compact
from pathwalker_cli.io.trajectory_csv import read_trajectory

__all__ = ["read_trials"]


def read_trials(
    folder: Path, condition: Condition, stances: Sequence[Mapping[str, str]]
) -> tuple[StudyTrial, ...]:
    """Return the trials of one condition as far as their files tell.

    Args:
        folder: Folder that `pathwalker id` wrote.
        condition: The condition.
        stances: Rows of its `stances.csv` by heading without unit.

    Raises:
        DataError: If a file of a trial cannot be used.
    """
    found = []
    for name in names_in(folder / condition):
        compact = read_compact(folder / condition, name)
        torques = folder / condition / f"{name}_torques.csv"
        own = [row for row in stances if (row["condition"], row["trial"]) == (condition, name)]
        found.append(
            StudyTrial(
                name,
                condition,
                compact.motion,
                compact.events,
                gait_cycles(compact.events),
                compact.forces,
                read_trajectory(torques, missing=True) if torques.is_file() else None,
                tuple(map(_stance, own)),
            )
        )
    return tuple(found)


def _stance(row: Mapping[str, str]) -> StanceForce:
    """Return what the plates know about a stance."""
    side: Side = "right" if row["side"] == "right" else "left"
    reason = "" if row["measured"] == "yes" else row["reason"] or "not measured"
    return StanceForce(Stance(side, int(row["strike"]), int(row["toe-off"])), None, reason)
