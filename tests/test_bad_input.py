"""Broken files of every kind: one sentence of the exception tree, at once, nothing left behind."""

from __future__ import annotations

import json
import os
import resource
import shutil
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import ezc3d
import pytest
from click.testing import CliRunner

from broken import ANGLES, ARCHIVES, EVENTS, HTML, JSON, TABLES, YAML, angles, bomb
from helpers import called_apart
from made_c3d import checked, write_c3d
from pathwalker_cli.checking.kinds import KINDS, check_orthosis
from pathwalker_cli.cli import REFUSED, cli
from pathwalker_cli.config import load_config
from pathwalker_cli.errors import InputError
from pathwalker_cli.gait.motion_file import read_motion, read_multipliers
from pathwalker_cli.inverse.markers import load_marker_set
from pathwalker_cli.inverse.study import load_inverse_dynamics, load_inverse_kinematics
from pathwalker_cli.io import c3d
from pathwalker_cli.io.recordings import read_compact
from pathwalker_cli.io.yaml_file import read_mapping, yaml_text
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.studies.base import load_study
from pathwalker_cli.studies.batch.cases import load_cases

MEMORY: Final = 4 << 30
"""Address space that a process may take to read broken files, beyond its libraries."""
THOUGHT: Final = 60
"""CPU time of such a process [s]."""

Load = Callable[[Path], Any]

STUDIES: Final = ("perturbation", "sensitivity", "uncertainty", "landscape", "tradeoff")

LOADERS: Final[dict[str, Load]] = {
    "patient": load_patient,
    "orthosis": lambda path: check_orthosis(str(path)),
    "prediction": load_config,
    "markers": load_marker_set,
    "cohort": load_cases,
    "inverse-dynamics": load_inverse_dynamics,
    "inverse-kinematics": load_inverse_kinematics,
    **{kind: lambda path, kind=kind: load_study(path, KINDS[kind][0]) for kind in STUDIES},
}
"""Readers of all kinds of YAML files."""

SHIPPED: Final = {
    "patient": shipped("patient_data") / "sreenivasa2017-patient" / "patient.yaml",
    "prediction": shipped("configs") / "mapd-orthosis.yaml",
    **{k: shipped("configs") / f"{k}.yaml" for k in LOADERS
       if (shipped("configs") / f"{k}.yaml").is_file()},
}  # fmt: skip
"""A file of each kind that is in order."""

JUNK: Final = ("text", HTML, "../../x", "", None, True, [], {}, [[[]]], {"a": 1}, -1e300, 10**400)
"""Values that few keys take."""


@pytest.fixture(autouse=True)
def _at_once() -> Iterator[None]:
    """Refuse what takes long: broken input must never make the program think."""
    begin = time.process_time()  # whatever else the machine does
    yield
    assert time.process_time() - begin < 60.0


def sentence(read: Callable[[], Any]) -> str:
    """Return the one printable line with which something is refused."""
    with pytest.raises(InputError) as caught:
        read()
    said = str(caught.value)
    assert said.isprintable(), said
    assert len(said) < 6000
    return said


def written(path: Path, content: bytes) -> Path:
    """Write a file and return its path."""
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("fault", YAML)
def test_broken_yaml_of_every_kind_is_refused(fault: str, tmp_path: Path) -> None:
    path = written(tmp_path / "made.yaml", YAML[fault])
    for load in LOADERS.values():
        assert str(tmp_path) in sentence(lambda load=load: load(path))


def leaves(value: Any, prefix: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Yield the places of all values below a mapping or list."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in items:
        yield (*prefix, key)
        if isinstance(inner, dict | list):
            yield from leaves(inner, (*prefix, key))


def with_junk(content: Any, place: tuple[str | int, ...], junk: object) -> Any:
    """Return a copy of plain values with another one in one place."""
    copy = json.loads(json.dumps(content))
    inner = copy
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = junk
    return copy


@pytest.mark.parametrize("kind", SHIPPED)
def test_junk_for_any_value_is_accepted_or_refused_in_a_sentence(kind: str, tmp_path: Path) -> None:
    content, _ = read_mapping(SHIPPED[kind])
    refused = 0
    for number, place in enumerate(leaves(content)):
        junk = JUNK[number % len(JUNK)]
        path = tmp_path / "made.yaml"
        path.write_text(yaml_text(with_junk(content, place, junk), "made"), encoding="utf-8")
        with suppress(InputError):
            refused += 1
            LOADERS[kind](path)
            refused -= 1
    assert refused


@pytest.mark.parametrize("fault", ["folder", "pipe", "link to itself", "broken link", "missing"])
@pytest.mark.parametrize("kind", LOADERS)
def test_what_is_no_file_is_refused(kind: str, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "made.yaml"
    if fault == "folder":
        path.mkdir()
    elif fault == "pipe":
        os.mkfifo(path)
    elif fault != "missing":
        path.symlink_to(path if fault == "link to itself" else tmp_path / "nowhere")
    sentence(lambda: LOADERS[kind](path))


@pytest.mark.parametrize("kind", LOADERS)
def test_a_name_too_long_and_an_endless_file_are_refused(kind: str) -> None:
    sentence(lambda: LOADERS[kind](Path("a" * 5000)))
    sentence(lambda: LOADERS[kind](Path("/dev/zero")))


@pytest.mark.parametrize("fault", TABLES)
def test_broken_angles_are_refused(fault: str, tmp_path: Path) -> None:
    written(tmp_path / "walk_angles.csv", TABLES[fault])
    written(tmp_path / "walk_events.csv", b"side,event,frame,time [s]\n")
    assert "walk_angles.csv" in sentence(lambda: read_compact(tmp_path, "walk"))


@pytest.mark.parametrize("fault", EVENTS)
def test_broken_events_are_refused(fault: str, tmp_path: Path) -> None:
    written(tmp_path / "walk_angles.csv", angles().encode())
    written(tmp_path / "walk_events.csv", EVENTS[fault])
    assert "walk_events.csv" in sentence(lambda: read_compact(tmp_path, "walk"))


@pytest.mark.parametrize("fault", TABLES)
def test_broken_forces_are_refused(fault: str, tmp_path: Path) -> None:
    written(tmp_path / "walk_angles.csv", angles().encode())
    written(tmp_path / "walk_events.csv", b"side,event,frame,time [s]\n")
    written(tmp_path / "walk_forces.csv", TABLES[fault])
    assert "walk_forces.csv" in sentence(lambda: read_compact(tmp_path, "walk"))


def test_the_made_table_is_in_order(tmp_path: Path) -> None:
    """The faults above are the only ones."""
    written(tmp_path / "walk_angles.csv", b"\xef\xbb\xbf" + angles().encode())
    written(tmp_path / "walk_events.csv", b"side,event,frame,time [s]\n")
    assert read_compact(tmp_path, "walk").motion.names == tuple(
        name.partition(" ")[0] for name in ANGLES.split(",")[1:]
    )


@pytest.mark.parametrize("fault", ARCHIVES)
def test_broken_archives_are_refused(fault: str, tmp_path: Path) -> None:
    content = ARCHIVES[fault]
    path = written(tmp_path / "made.npz", content if isinstance(content, bytes) else content())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for read in (read_motion, read_multipliers):
        assert "made.npz" in sentence(lambda read=read: read(path))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000


@pytest.fixture
def run(made_runs: Path, tmp_path: Path) -> Path:
    """Return the folder of a converged run without figures."""
    return Path(shutil.copytree(made_runs / "mapd-orthosis", tmp_path / "run"))


@pytest.mark.parametrize("fault", JSON)
def test_broken_metrics_are_refused(fault: str, run: Path) -> None:
    written(run / "metrics.json", JSON[fault])
    assert "metrics.json" in sentence(lambda: load_run(run))


@pytest.mark.parametrize("name", ["metrics.json", "motion.npz", "config.resolved.yaml"])
@pytest.mark.parametrize("fault", ["missing", "folder", "pipe", "link to itself"])
def test_runs_that_lack_a_file_are_refused(name: str, fault: str, run: Path) -> None:
    (run / name).unlink()
    if fault == "folder":
        (run / name).mkdir()
    elif fault == "pipe":
        os.mkfifo(run / name)
    elif fault == "link to itself":
        (run / name).symlink_to(run / name)
    assert str(run) in sentence(lambda: load_run(run))


@pytest.mark.parametrize(
    "key",
    ["run_format", "problem", "status", "condition", "motion_hash", "input_hashes", "versions"],
)
def test_metrics_of_another_version_or_type_are_refused(key: str, run: Path) -> None:
    content = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    for junk in (None, [], {"a": 1}, 0):
        (run / "metrics.json").write_text(json.dumps({**content, key: junk}), encoding="utf-8")
        sentence(lambda: load_run(run, allow_unconverged=True))


def flipped(at: int, value: int) -> Callable[[bytes], bytes]:
    """Return what puts another byte into a file."""
    return lambda data: data[:at] + bytes([value]) + data[at + 1 :]


def renamed(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    """Return what renames a parameter."""
    return lambda data: data.replace(old, new, 1)


C3D: Final[dict[str, Callable[[bytes], bytes]]] = {
    "empty": lambda data: b"",
    "one byte": lambda data: data[:1],
    **{f"cut after {n} bytes": (lambda data, n=n: data[:n]) for n in (100, 512, 700, 915, 2000)},
    "no magic number": flipped(1, 0),
    "parameters elsewhere": flipped(0, 200),
    "65535 markers": lambda data: data[:2] + b"\xff\xff" + data[4:],
    "65535 analog samples": lambda data: data[:4] + b"\xff\xff" + data[6:],
    "65534 frames": lambda data: data[:8] + struct.pack("<H", 65534) + data[10:],
    "data elsewhere": lambda data: data[:16] + b"\xff\xff" + data[18:],
    "no scale": renamed(b"SCALE\x1e", b"LCALE\x1e"),
    "no offset": renamed(b"OFFSET", b"OFFSEX"),
    "no labels": renamed(b"LABELS", b"LABELX"),
    "no units": renamed(b"UNITS", b"UNITX"),
    "no group of points": renamed(b"POINT", b"POINX"),
    "zeros": lambda data: bytes(len(data)),
    "ones": lambda data: b"\xff" * len(data),
    "text": lambda data: b"walk\n" * 1000,
    "HTML": lambda data: HTML.encode() * 100,
}
"""What breaks a C3D file in order."""


@pytest.mark.parametrize("fault", C3D)
def test_broken_c3d_files_are_refused_and_kill_nobody(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(c3d, "_LONGEST", 2.0)
    path = write_c3d(tmp_path / "walk.c3d", plate=True)
    path.write_bytes(C3D[fault](path.read_bytes()))
    assert "walk" in sentence(lambda: checked(path, ("LASI", "RTOE"), 1.0))


def limited() -> None:
    """Take memory and time from a process that is about to start."""
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY, taken + MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (THOUGHT, THOUGHT))


WORST: Final[dict[str, tuple[str, bytes, list[str]]]] = {
    "billion laughs as config": ("made.yaml", bomb(), ["solve", "-c", "made.yaml"]),
    "billion laughs as patient": ("made.yaml", bomb(), ["model", "made.yaml", "-o", "x.urdf"]),
    "billion laughs to check": ("made.yaml", bomb(), ["check", "made.yaml"]),
    "50 MB to check": ("made.yaml", YAML["50 MB"], ["check", "made.yaml"]),
    "nested to check": ("made.yaml", YAML["deeply nested lists"], ["check", "made.yaml"]),
    "NUL byte to check": ("made.yaml", YAML["NUL byte"], ["check", "made.yaml"]),
    "endless file": ("made.yaml", b"", ["check", "/dev/zero"]),
    "name too long": ("made.yaml", b"", ["check", "a" * 5000]),
    "C3D of words": ("a.c3d", b"words", ["import", "a.c3d", "--patient", "sreenivasa2017-patient",
                                         "--condition", "barefoot", "-o", "out"]),
    "nested metrics": ("metrics.json", JSON["deeply nested"], ["compare", ".", "."]),
    "metrics of words": ("metrics.json", b"words", ["verify", "."]),
    "metrics with NaN": ("metrics.json", JSON["NaN"], ["report", ".", "-o", "x.html"]),
}  # fmt: skip
"""File, content and command that are tried in a process with little memory."""


@pytest.mark.parametrize("fault", WORST)
def test_the_worst_in_a_process_with_little_memory(fault: str, tmp_path: Path) -> None:
    name, content, words = WORST[fault]
    written(tmp_path / name, content)
    done = called_apart(tmp_path, *words, prepare=limited)
    assert done.returncode == REFUSED, done.stderr
    assert "Error: " in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["../../x", "/etc/x", "..", "", "a/b", HTML, "a\nb", "x" * 65])
def test_ids_and_names_that_are_no_names_of_folders_are_refused(name: str, tmp_path: Path) -> None:
    patient, _ = read_mapping(SHIPPED["patient"])
    path = tmp_path / "made.yaml"
    path.write_text(yaml_text({**patient, "id": name}, "made"), encoding="utf-8")
    assert "id: is " in sentence(lambda: load_patient(path))
    cohort, _ = read_mapping(SHIPPED["cohort"])
    path.write_text(yaml_text({**cohort, "cases": [{"name": name}]}, "made"), encoding="utf-8")
    assert "name: is " in sentence(lambda: load_cases(path))


def test_trials_outside_the_folder_of_recordings_are_not_found(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["id", "inverse-dynamics", "--set", "trials=[../../x]", "--out", str(out)]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == REFUSED
    assert "../../x" in done.stderr
    assert not out.exists()


def test_no_name_of_a_subject_reaches_output(tmp_path: Path) -> None:
    """Names and birth dates in the parameters of C3D files stay there."""
    path = write_c3d(tmp_path / "walk.c3d", plate=True)
    file = ezc3d.c3d(str(path))
    labels = file["parameters"]["POINT"]["LABELS"]["value"]
    file["parameters"]["POINT"]["LABELS"]["value"] = [f"JOHN DOE:{label}" for label in labels]
    for name, value in (("NAMES", "JOHN DOE"), ("DATE_OF_BIRTH", "1999-12-31")):
        file.add_parameter("SUBJECTS", name, [value])
    file.add_parameter("MANUFACTURER", "OPERATOR", ["JOHN DOE"])
    file.write(str(path))
    patient = tmp_path / "child"
    shutil.copytree(SHIPPED["patient"].parent, patient)
    said = ""
    for command in (
        ["import", path, "--patient", patient, "--condition", "barefoot",
         "-o", patient / "recordings" / "barefoot"],
        ["ik", "inverse-kinematics", "--set", f"c3d.barefoot=[{path}]", "--out", tmp_path / "ik"],
        ["id", "inverse-dynamics", "--set", "conditions=[barefoot]",
         "--set", f"patient={patient}", "--out", tmp_path / "id"],
        ["report", tmp_path / "id", "-o", tmp_path / "page.html"],
    ):  # fmt: skip
        done = CliRunner().invoke(cli, [str(word) for word in command])
        assert done.exit_code == 0, done.stderr
        said += done.output + done.stderr
    assert (tmp_path / "id" / "barefoot" / "walk_torques.csv").is_file()
    written_files = [p for p in tmp_path.rglob("*") if p.is_file() and p != path]
    assert len(written_files) > 10
    said += "".join(p.read_bytes().decode("latin-1") for p in written_files)
    assert "JOHN" not in said
    assert "1999-12-31" not in said
