"""Whatever a file holds, its reader returns something valid or raises an InputError.

The suite tries a few examples, always the same; `pytest tests/test_fuzz.py
--hypothesis-profile=long` tries many, each time others.
"""

from __future__ import annotations

import io
import json
import os
import random
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from broken import angles, arrays
from helpers import stylised_series
from made_c3d import checked, write_c3d
from pathwalker_cli.config import load_config
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.gait.motion_file import read_motion, read_multipliers, write_motion
from pathwalker_cli.inverse.c3d_trials import c3d_trials
from pathwalker_cli.inverse.markers import load_marker_set
from pathwalker_cli.inverse.study import RecordedConfig
from pathwalker_cli.inverse.text import stance_notes
from pathwalker_cli.io import c3d
from pathwalker_cli.io.c3d_write import write_c3d as write_recording
from pathwalker_cli.io.json_file import read_json
from pathwalker_cli.io.recordings import read_compact
from pathwalker_cli.io.trajectory_csv import read_trajectory
from pathwalker_cli.io.yaml_file import read_mapping
from pathwalker_cli.nlp import tape_store
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import load_patient
from pathwalker_cli.studies.batch.schema import load_batch

Read = Callable[[Path], Any]

EVENTS: Final = b"side,event,frame,time [s]\nright,foot_strike,2,0.02\nleft,toe_off,9,0.09\n"


@cache
def folder() -> Path:
    """Return a folder that lives as long as the process."""
    return Path(_FOLDER.name)


_FOLDER = tempfile.TemporaryDirectory()


def tried(read: Read, name: str, content: bytes) -> None:
    """Read a file; pass over a refusal that is one printable line."""
    path = folder() / name
    path.write_bytes(content)
    try:
        read(path)
    except InputError as error:
        said = str(error)
    else:
        said = ""
    assert said == "" or said.isprintable()


def mutated(content: bytes, seed: int) -> bytes:
    """Return a content with bytes changed, taken out, put in twice, or cut off."""
    rng = random.Random(seed)
    data = bytearray(content)
    for _ in range(rng.randrange(1, 6)):
        at, length = rng.randrange(len(data) + 1), rng.randrange(1, 40)
        match rng.randrange(5):
            case 0:
                data[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                del data[at : at + length]
            case 2:
                data[at:at] = data[at : at + length]
            case 3:
                token = (
                    b"nan",
                    b"-",
                    b"[",
                    b"{",
                    b": ",
                    b"\n",
                    b"&a ",
                    b"*a",
                    b"1e999",
                    b'"',
                    b"!!int ",
                )
                data[at:at] = rng.choice(token)
            case _:
                if not rng.randrange(8):
                    del data[at:]
    return bytes(data)


@cache
def motion() -> bytes:
    """Return the archive of a motion that is in order."""
    path = folder() / "good.npz"
    write_motion(path, stylised_series().motion)
    return path.read_bytes()


@cache
def shipped_text(name: str) -> bytes:
    """Return a file that comes with PathWalker."""
    return (shipped("configs").parent / name).read_bytes()


def compact(path: Path) -> None:
    """Read a recording whose angles or events are broken."""
    read_compact(path.parent, path.name.rpartition("_")[0])


PATIENT: Final = "patient_data/sreenivasa2017-patient/patient.yaml"
READERS: Final[dict[str, tuple[Read, str, Callable[[], bytes]]]] = {
    "patient": (load_patient, "made.yaml", lambda: shipped_text(PATIENT)),
    "config": (load_config, "made.yaml", lambda: shipped_text("configs/mapd-orthosis.yaml")),
    "markers": (load_marker_set, "made.yaml", lambda: shipped_text("configs/markers.yaml")),
    "cohort": (load_batch, "made.yaml", lambda: shipped_text("configs/cohort.yaml")),
    "trajectory": (read_trajectory, "made.csv", lambda: angles().encode()),
    "angles": (compact, "walk_angles.csv", lambda: angles().encode()),
    "events": (compact, "run_events.csv", lambda: EVENTS),
    "motion": (read_motion, "made.npz", motion),
    "multipliers": (read_multipliers, "made.npz", lambda: arrays(unknowns=[1.0], rows=[2.0])),
    "metrics": (read_json, "made.json", lambda: json.dumps({"a": [1, None], "b": "x"}).encode()),
}
"""Reader, name of its file, and content that is in order."""


@pytest.fixture(autouse=True, scope="module")
def _beside() -> None:
    """Put files in order beside the broken ones that need them."""
    (folder() / "walk_events.csv").write_bytes(EVENTS)
    (folder() / "run_angles.csv").write_text(angles(), encoding="utf-8")


@pytest.mark.parametrize("name", READERS)
def test_the_content_that_is_broken_later_is_in_order(name: str) -> None:
    read, file, content = READERS[name]
    (folder() / file).write_bytes(content())
    read(folder() / file)


@pytest.mark.parametrize("name", READERS)
@given(content=st.binary(max_size=400))
def test_any_bytes(name: str, content: bytes) -> None:
    read, file, _ = READERS[name]
    tried(read, file, content)


@pytest.mark.parametrize("name", READERS)
@given(seed=st.integers(0, 2**63))
def test_files_with_some_bytes_changed(name: str, seed: int) -> None:
    read, file, content = READERS[name]
    tried(read, file, mutated(content(), seed))


PLAIN: Final = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
    | st.sampled_from([10**400, "\0", "../../x", "<b>", "a" * 300]),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


@pytest.mark.parametrize("name", ["patient", "config", "markers", "cohort"])
@given(data=st.data())
def test_any_value_for_any_key(name: str, data: st.DataObject) -> None:
    read, file, content = READERS[name]
    good = folder() / "good.yaml"
    good.write_bytes(content())
    mapping, _ = read_mapping(good)
    inner: Any = mapping
    while True:
        keys = list(inner) if isinstance(inner, dict) else list(range(len(inner)))
        key = data.draw(st.sampled_from(keys))
        deeper = isinstance(inner[key], dict | list) and inner[key]
        if not deeper or data.draw(st.booleans()):
            break
        inner = inner[key]
    inner[key] = data.draw(PLAIN)
    tried(read, file, yaml.safe_dump(mapping, allow_unicode=True).encode("utf-8", "replace"))


@pytest.mark.parametrize("problem", ["[]", "{}", "{[]: 1}", "null", "[mapd-orthosis]"])
def test_a_problem_that_is_no_text(problem: str) -> None:
    """A config asks what problem it is for before anything is validated."""
    read, file, _ = READERS["config"]
    tried(read, file, f"problem: {problem}\n".encode())


@pytest.mark.parametrize("name", ["motion", "multipliers"])
@given(data=st.data())
def test_any_array_for_any_array(name: str, data: st.DataObject) -> None:
    read, file, content = READERS[name]
    (folder() / file).write_bytes(content())
    with np.load(folder() / file) as archive:
        found = {key: archive[key] for key in archive.files}
    key = data.draw(st.sampled_from(sorted(found)))
    shape = data.draw(st.lists(st.integers(0, 3), max_size=4))
    kind = data.draw(st.sampled_from(["f8", "f4", "i8", "c16", "U3", "S3", "?", "M8[s]"]))
    found[key] = np.zeros(shape, kind)
    tried(read, file, arrays(**found))


@pytest.mark.parametrize("key", ["durations", "parameters", "right_toe.states"])
def test_complex_numbers_are_no_motion(key: str) -> None:
    with np.load(io.BytesIO(motion())) as archive:
        found = {name: archive[name] for name in archive.files}
    found[key] = found[key] * (1.0 + 1.0j)
    (folder() / "made.npz").write_bytes(arrays(**found))
    with pytest.raises(DataError, match=r"no numbers|not finite"):
        read_motion(folder() / "made.npz")


@cache
def walk() -> bytes:
    """Return a C3D file that is in order."""
    return write_c3d(folder() / "walk.c3d", plate=True).read_bytes()


@given(seed=st.integers(0, 2**63))
@example(seed=179_076_567_587_048)  # more labels than points
def test_c3d_files_with_some_bytes_changed(seed: int) -> None:
    """Every example takes a process, and some kill it."""
    rng = random.Random(seed)
    data = bytearray(walk())
    end = rng.choice([512, 4096, len(data)])
    for _ in range(rng.randrange(1, 8)):
        data[rng.randrange(end)] = rng.choice([0, 1, 127, 128, 255, rng.randrange(256)])
    if not rng.randrange(5):
        del data[rng.randrange(len(data)) :]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c3d, "_LONGEST", 2.0)
        tried(lambda path: checked(path, ("LASI", "RTOE"), 1.0), "made.c3d", bytes(data))


def damage(positions: np.ndarray, rng: random.Random) -> np.ndarray:
    """Return marker positions (n, m, 3) with something wrong in them."""
    made, (frames, markers, _) = positions.copy(), positions.shape
    frame, marker = rng.randrange(1, frames), rng.randrange(markers)
    match rng.randrange(10):
        case 0:
            made[frame : frame + rng.randrange(60), rng.randrange(markers) :] = np.nan
        case 1:
            made[:, marker] = np.nan
        case 2:
            made *= 10.0 ** rng.randint(-4, 4)
        case 3:
            made[frame:, marker] += rng.choice([0.3, 5.0, 1e30])
        case 4:
            made[:] = made[frame]
        case 5:
            made = made[..., [rng.randrange(3) for _ in range(3)]]
        case 6:
            made = np.concatenate([made, made[::-1]])
        case 7:
            made = made[:frame]
        case 8:
            made *= [rng.choice([1.0, -1.0, 0.0]) for _ in range(3)]
        case _:
            made[np.random.default_rng(frame).random(made.shape[:2]) < 0.7] = np.nan
    return made


@given(seed=st.integers(0, 2**63))
def test_recordings_with_anything_in_them_are_evaluated_or_refused(seed: int) -> None:
    rng = random.Random(seed)
    recording = c3d.read_c3d(write_c3d(folder() / "whole.c3d", plate=True))
    positions = recording.positions
    for _ in range(rng.randrange(1, 4)):
        positions = damage(positions, rng)
    samples = len(positions) * recording.samples_per_frame
    (plate,) = recording.plates
    corners = plate.corners[[rng.randrange(4) for _ in range(4)]]
    force = np.resize(plate.force, (samples, 3)) * rng.choice([1.0, -1.0, 0.0, 1e6])
    moment = np.resize(plate.moment, (samples, 3)) * rng.choice([1.0, -1.0, 1e3])
    plate = replace(plate, corners=corners, force=force, moment=moment)
    events = tuple(
        replace(event, frame=rng.randrange(len(positions)))
        for event in recording.events[: rng.randrange(8)]
    )
    broken = replace(recording, positions=positions, plates=(plate,), events=events)
    write_recording(folder() / "walk.c3d", broken)
    patient, config = load_patient("sreenivasa2017-patient"), RecordedConfig(patient="")

    def read(path: Path) -> None:
        for trial, _ in c3d_trials([path], patient, "barefoot", config):
            assert np.isfinite(trial.motion.values).all()
            assert all(map(str.isprintable, (*trial.remarks, *stance_notes(trial), *trial.doubts)))

    tried(read, "walk.c3d", (folder() / "walk.c3d").read_bytes())


@given(seed=st.integers(0, 2**63), content=st.binary(max_size=200))
def test_kept_tapes_with_some_bytes_changed_are_not_there(seed: int, content: bytes) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATHWALKER_CACHE", str(folder() / "cache"))
        patch.setattr(tape_store, "_made_by", lambda makers: "made")
        tape_store.keep_tapes("a", {})
        (path,) = (folder() / "cache").glob("*.tapes")
        assert tape_store.kept_tapes("a") == {}
        kept = path.read_bytes()
        for broken in (mutated(kept, seed), content):
            path.write_bytes(broken)
            with suppress(FileNotFoundError):
                assert tape_store.kept_tapes("a") == (None if broken != kept else {})
        os.unlink(path)
