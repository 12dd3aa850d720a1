"""Make the tables of docs/learning.md that hold walks against recordings, row by row.

python benchmarks/learnt_walks.py FOLDER [ROW ...]

Every row is one prediction by the command line, learnt anew where it says so; runs stay in FOLDER,
and what stands there is not solved again.  Without names all rows are made; "learn" learns alone.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from pathwalker_cli.errors import DataError, PathwalkerError
from pathwalker_cli.evaluation.differences import (
    JOINTS,
    force_rms,
    recorded_force_rms,
    recorded_rms_mean_cycle,
    rms_mean_cycle,
)
from pathwalker_cli.evaluation.norms import within_norms
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait, recorded_numbers
from pathwalker_cli.evaluation.run import run_and_gait
from pathwalker_cli.io.json_file import read_json
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.measures import measure_of, metrics_of
from pathwalker_cli.stride.stride import Stride

CHILD: Final = "sreenivasa2017-patient"
SIDES: Final = ("right", "left")
_WALK: Final = ("walking_speed", "step_length_right", "step_length_left")
SOFT: Final = {"model.feet": "compliant"}
POINTS: Final = {"model.feet": "points"}
COARSE: Final = {"compliant": [40, 40], "points": [12, 8, 4, 5, 12, 8, 4, 5]}
"""Mesh of learning by feet; the shipped one has 58 intervals, soles that give way need more."""


@dataclass(frozen=True)
class Row:
    """A prediction.

    Args:
        config: Its shipped config.
        changes: Overrides of it.
        learn: What is changed of configs/learn.yaml before learning, by dotted key; None: the
            numbers that are shipped.
    """

    config: str
    changes: dict[str, Any] = field(default_factory=dict)
    learn: dict[str, Any] | None = None


def rows() -> dict[str, Row]:
    """Return all rows by name."""
    trials = list(recording_names(load_patient(CHILD), "barefoot"))
    blind = {"weights.forces": 0.0, "weights.moments": 0.0}
    single, back = {"without": trials[1:]}, {"condition": "orthosis"}
    soles = {"model.feet": "sole", "model.tissue": True, "bounds.phase_durations": {}}
    return {
        "predict-barefoot": Row("predict-barefoot"),
        "barefoot, soles that give way": Row("predict-barefoot", SOFT),
        "barefoot, soles that give way, learnt": Row("predict-barefoot", SOFT, SOFT),
        "mapd-barefoot": Row("mapd-barefoot"),
        "predict-orthosis": Row("predict-orthosis"),
        "orthosis, soles that give way": Row("predict-orthosis", SOFT),
        "orthosis, soles that give way, learnt": Row("predict-orthosis", SOFT, SOFT),
        "orthosis, points, learnt": Row("predict-orthosis", POINTS, POINTS),
        "orthosis, from angles": Row("predict-orthosis", {}, blind),
        "orthosis, from one trial": Row("predict-orthosis", {}, single),
        "mapd-orthosis": Row("mapd-orthosis"),
        "barefoot, from orthoses": Row("predict-barefoot", {}, back),
        "healthy, points": Row("mapd-healthy"),
        "healthy, soles": Row("mapd-healthy", soles),
    }


def pathwalker(*words: str) -> None:
    """Run a command, and leave what it says in the log of this one."""
    print("$ pathwalker", *words, file=sys.stderr, flush=True)
    call = "from pathwalker_cli.cli import main; main()"
    subprocess.run([sys.executable, "-c", call, *words], check=False, stdout=sys.stderr)


def learnt_anew(changes: dict[str, Any], folder: Path) -> Path:
    """Return what was learnt with these changes; numbers that the feet do not have are left out."""
    file = folder / "learnt.yaml"
    if file.is_file():
        return file
    content = yaml.safe_load((shipped("configs") / "learn.yaml").read_text(encoding="utf-8"))
    for key, value in changes.items():
        if key.startswith("model."):
            content["set"] |= {key: value, "mesh.intervals": COARSE[value]}
            continue
        *outer, last = key.split(".")
        inner = content[outer[0]] if outer else content
        inner[last] = value
    if changes.get("model.feet") == "points":
        del content["numbers"]["sole_roundness"]
    folder.mkdir(parents=True, exist_ok=True)
    config = folder.with_suffix(".yaml")
    config.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    pathwalker("learn", str(config), "--out", str(folder))
    print(learning(folder), flush=True)
    return file


def learning(folder: Path) -> str:
    """Return what learning came to: misfits, angles and left-out trials [deg], time."""
    found = read_json(folder / "learn.json")
    joints = np.rad2deg([found["rms_mean_cycle"][joint] for joint in JOINTS])
    left = found["left_out"]
    out = "" if left is None else f", left out {np.rad2deg(left['learnt']):.1f} deg"
    walk = (f"{key} {found['walk'][key]['learnt']:.3f}" for key in _WALK)
    return (
        f"{folder.name}: misfit {min(found['misfits']):.2f}, of it priors "
        f"{found['prior_misfit']:.2f}; {', '.join(f'{x:.1f}' for x in joints)}, mean "
        f"{joints.mean():.1f} deg{out}; {', '.join(walk)}; {found['solves']} predictions, "
        f"{found['iterations']} iterations, {found['seconds_cpu']:.0f} CPU s; bounds "
        f"{', '.join(found['active_bounds']) or 'none'}"
    )


def walk(name: str, row: Row, folder: Path) -> Stride:
    """Return the stride of a row, solved unless it is there."""
    place = folder / name.replace(", ", "--").replace(" ", "-")
    changes = {"verdict": False, "figures": "none", **row.changes}
    if row.learn is not None:
        key = "-".join(f"{k}_{v}" for k, v in row.learn.items() if k != "without") or "one-trial"
        changes["learnt"] = learnt_anew(row.learn, folder / f"learn-{key}").resolve()
    if not (place / "metrics.json").is_file():
        problem = row.config.replace("predict", "mapd")
        words = [word for k, v in changes.items() for word in ("--set", f"{k}={v}")]
        pathwalker("solve", problem, row.config, "--out", str(place), *words)
    return run_and_gait(place, name)[1]


def cells(stride: Stride, recorded: RecordedGait) -> Iterator[str]:
    """Yield the differences of the joints and their mean [deg], speed [m/s] and steps [m]."""
    rms = np.rad2deg([rms_mean_cycle(stride, recorded)[joint] for joint in JOINTS])
    yield from (f"{value:.1f}" for value in (*rms, rms.mean()))
    found = metrics_of(stride)
    yield f"{found['walking_speed']:.3f}"
    yield ", ".join(f"{found[f'step_length_{side}']:.3f}" for side in SIDES)


FORCES: Final = {
    "vertical peak [body weights]": ("peak_vertical_force_{}_body_weights", 2),
    "ankle torque slope [N m/rad]": ("ankle_torque_slope_stance_{}", 0),
    "ankle torque peak [N m]": ("peak_net_ankle_torque_{}", 0),
}


def forces(stride: Stride, recorded: RecordedGait) -> Iterator[str]:
    """Yield the difference of vertical forces in stance, and what else forces say."""
    yield f"vertical RMS {force_rms(stride, recorded)['rms_vertical_force_stance']:.0f} N"
    for label, (key, digits) in FORCES.items():
        values = (measure_of(key.format(side)).of(stride) for side in SIDES)
        yield f"{label} {', '.join(f'{value:.{digits}f}' for value in values)}"


def own_forces(recorded: RecordedGait) -> Iterator[str]:
    """Yield the same of the child's own stances, with their ranges."""
    spread = recorded_force_rms(recorded)["rms_vertical_force_stance"]
    yield f"vertical RMS {spread.mean:.0f} ({spread.low:.0f} to {spread.high:.0f}) N"
    for label, (key, digits) in FORCES.items():
        measures = [measure_of(key.format(side)) for side in SIDES]
        found = recorded_numbers(recorded, measures).values()
        spans = (f"{x.mean:.{digits}f} ({x.low:.{digits}f} to {x.high:.{digits}f})" for x in found)
        yield f"{label} {', '.join(spans)}"


def own(recorded: RecordedGait) -> Iterator[str]:
    """Yield the same of the child's own cycles."""
    spreads = recorded_rms_mean_cycle(recorded)
    rms = np.rad2deg([spreads[joint].mean for joint in JOINTS])
    yield from (f"{value:.1f}" for value in (*rms, rms.mean()))
    found = recorded_numbers(recorded)
    speed = found["walking_speed"]
    yield f"{speed.low:.2f} to {speed.high:.2f}, mean {speed.mean:.3f}"
    yield ", ".join(f"{found[f'step_length_{side}'].mean:.3f}" for side in SIDES)


def main(folder: Path, wanted: list[str]) -> None:
    """Print the rows."""
    folder.mkdir(parents=True, exist_ok=True)
    if not wanted or "learn" in wanted:
        learnt_anew({}, folder / "learn")
    known: dict[str, RecordedGait] = {}
    for name, row in rows().items():
        if wanted and name not in wanted:
            continue
        try:
            stride = walk(name, row, folder)
        except PathwalkerError as error:
            print(f"| {name} | {error} |", flush=True)
            continue
        if name.startswith("healthy"):
            shares = ", ".join(f"{k} {100 * v:.0f} %" for k, v in within_norms(stride).items())
            print(f"{name}: within two deviations of typical children {shares}", flush=True)
            continue
        condition = stride.walker.condition
        if condition not in known:
            recorded = recorded_gait(stride.walker)
            if recorded is None:
                raise DataError("there are no recordings", where=condition)
            known[condition] = recorded
            print(f"| {condition}, own cycles | {' | '.join(own(recorded))} |")
            print(f"  {'; '.join(own_forces(recorded))}")
        print(f"| {name} | {' | '.join(cells(stride, known[condition]))} |")
        print(f"  {'; '.join(forces(stride, known[condition]))}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
