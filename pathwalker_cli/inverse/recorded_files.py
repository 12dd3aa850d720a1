"""Files of recorded gait: per trial CSV, .mot and .sto, tables over trials, `strengths.yaml`."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.study_tables import ResidualTable, StrengthTable
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.opensim import force_table, torque_table, write_opensim
from pathwalker_cli.io.recordings import CompactRecording, write_recording
from pathwalker_cli.io.trajectory_csv import write_trajectory
from pathwalker_cli.patient.blocks import Strengths

__all__ = [
    "staged_folder",
    "strength_lines",
    "write_marker_table",
    "write_residuals",
    "write_stances",
    "write_strengths",
    "write_strengths_yaml",
    "write_trial",
]

_COMPONENTS: Final = ("forward", "up", "moment")
_UNITS: Final = ("N", "N", "N m")


@contextmanager
def staged_folder(target: str | Path) -> Iterator[Path]:
    """Yield an empty folder whose files move into `target` when the block ends without an error.

    After an error nothing is there that was not before.

    Args:
        target: Where the files shall be; files of the same name are replaced.

    Raises:
        DataError: If the target is a file or cannot be written.
    """
    target = Path(target)
    above = next(folder for folder in (target, *target.parents) if folder.exists())
    if not above.is_dir():
        raise DataError("is a file", where=str(above), mend="choose a folder for the output")
    if not os.access(above, os.W_OK):
        raise DataError("cannot be written", where=str(above), mend="choose another folder")
    beside = target.parent if target.exists() else above
    if not os.access(beside, os.W_OK):
        beside = above
    staging = None
    try:
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".tmp", dir=beside))
        yield staging
        for source in sorted(path for path in staging.rglob("*") if path.is_file()):
            place = target / source.relative_to(staging)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, place)
    except OSError as problem:
        raise DataError(f"cannot be written: {problem.strerror}", where=str(target)) from None
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)


def write_trial(folder: Path, trial: StudyTrial) -> None:
    """Write one trial: angles, events, forces, torques and markers, as far as there are any."""
    compact = CompactRecording(trial.name, trial.motion, trial.events, trial.forces)
    write_recording(folder, compact)
    stem = str(folder / trial.name)
    write_opensim(f"{stem}_angles.mot", trial.motion)
    if trial.forces is not None:
        write_opensim(f"{stem}_grf.mot", force_table(trial.forces))
    if trial.tau is not None:
        write_trajectory(f"{stem}_torques.csv", trial.tau)
        write_opensim(f"{stem}_torques.sto", torque_table(trial.tau))
    if trial.markers is not None:
        rows = [row[2:] for row in _marker_rows([trial])]
        write_table(f"{stem}_residuals.csv", list(_MARKER_HEADER[2:]), rows)


_MARKER_HEADER: Final = (
    "condition", "trial", "point", "rms [m]", "largest [m]", "frames seen", "frames bridged"
)  # fmt: skip


def _marker_rows(trials: Iterable[StudyTrial]) -> list[list[object]]:
    """Return one row per trial and marker point."""
    rows: list[list[object]] = []
    for trial in trials:
        if trial.markers is None:
            continue
        rms = trial.markers.rms()
        for name, distances in zip(trial.markers.names, trial.markers.distances.T, strict=True):
            marker = name.partition(" ")[0]
            bridged = sum(gap.frames for gap in trial.gaps if gap.marker == marker and gap.bridged)
            seen = distances[np.isfinite(distances)]
            largest = f"{seen.max():.6g}" if seen.size else ""
            shown = f"{rms[name]:.6g}" if seen.size else ""
            rows.append(
                [trial.condition, trial.name, name, shown, largest, seen.size - bridged, bridged]
            )
    return rows


def write_marker_table(path: Path, trials: Iterable[StudyTrial]) -> None:
    """Write the distance of every marker point in every trial."""
    write_table(path, list(_MARKER_HEADER), _marker_rows(trials))


def write_stances(path: Path, trials: Iterable[StudyTrial]) -> None:
    """Write which stances are measured, and why the others are not."""
    rows = [
        [trial.condition, trial.name, item.stance.side, item.stance.strike, item.stance.toe_off,
         "" if item.plate is None else item.plate + 1, "yes" if item.measured else "no",
         item.reason]
        for trial in trials
        for item in trial.stances
    ]  # fmt: skip
    header = ["condition", "trial", "side", "strike [frame]", "toe-off [frame]", "plate",
              "measured", "reason"]  # fmt: skip
    write_table(path, header, rows)


def write_residuals(path: Path, tables: Sequence[ResidualTable]) -> None:
    """Write mean and RMS residuals per trial and mean, min and max of the means over trials."""
    header = ["condition", "part", "trial", "frames"]
    header += [f"{name} {what} [{unit}]" for what in ("mean", "rms")
               for name, unit in zip(_COMPONENTS, _UNITS, strict=True)]  # fmt: skip
    header += [f"{name} mean [{unit}/kg]"
               for name, unit in zip(_COMPONENTS, _UNITS, strict=True)]  # fmt: skip
    rows: list[list[object]] = []
    for table in tables:
        start = [table.condition, table.part]
        for item in table.trials:
            values = [*item.mean, *item.rms, *(item.mean / table.body_mass)]
            rows.append([*start, item.trial, item.frames, *(f"{x:.5g}" for x in values)])
        if table.range is not None:
            span = table.range
            for name, mean in (("mean", span.mean), ("min", span.lowest), ("max", span.highest)):
                per_mass = mean / table.body_mass
                shown = [f"{x:.5g}" for x in mean], [f"{x:.5g}" for x in per_mass]
                rows.append([*start, f"{name} over trials", "", *shown[0], "", "", "", *shown[1]])
    write_table(path, header, rows)


def write_strengths(path: Path, table: StrengthTable) -> None:
    """Write all strengths with their origin, the patient's file and what is uncertain."""
    header = ["generator", "strength [N m]", "patient file [N m]", "deviation [%]", "stances",
              "peak torque [N m]", "angle [rad]", "speed [rad/s]", "least of single stances [N m]",
              "largest of single stances [N m]", "remark"]  # fmt: skip
    rows: list[list[object]] = []
    for row in table.rows:
        given = "" if row.given is None else f"{row.given:.5g}"
        deviation = "" if row.deviation is None else f"{100.0 * row.deviation:.1f}"
        peak: list[object] = ["", "", "", ""]
        if row.peak is not None:
            values = (row.peak.torque, row.peak.angle, row.peak.speed)
            peak = [row.peak.count, *(f"{value:.5g}" for value in values)]
        single = ["" if np.isnan(x) else f"{x:.5g}" for x in (row.lowest, row.highest)]
        rows.append(
            [row.generator, f"{row.value:.5g}", given, deviation, *peak, *single, row.remark]
        )
    write_table(path, header, rows)


def write_strengths_yaml(path: Path, strengths: Strengths, source: str) -> None:
    """Write the block `strengths` as a patient's file takes it.

    Args:
        path: The file.
        strengths: Maximum isometric torques [N m].
        source: Where they come from, one line.
    """
    lines = [f"# Maximum isometric torques [N m]: {source}", "strengths:"]
    lines += strength_lines(strengths)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def strength_lines(strengths: Strengths) -> list[str]:
    """Return what stands below `strengths:` in a patient's file [N m]."""
    lines = []
    for name, value in strengths.model_dump().items():
        if isinstance(value, dict):
            shown = f"{{right: {value['right']:.4f}, left: {value['left']:.4f}}}"
        else:
            shown = f"{value:.4f}"
        lines.append(f"  {name}: {shown}")
    return lines
