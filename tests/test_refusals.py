"""Bad input of `import`, `ik` and `id` in a process of its own: exit code, message, no traces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from helpers import called_apart
from made_c3d import cut, text, write_c3d
from pathwalker_cli.cli import cli
from pathwalker_cli.paths import shipped

C3D = "walk.c3d"

Words = list[str]


def imported(*more: str) -> Words:
    """Return the words that import the recording into a new folder."""
    words = ["import", C3D, "--patient", "sreenivasa2017-patient", "--condition", "barefoot"]
    return [*words, *(more or ("-o", "out"))]


def kinematics(*changes: str) -> Words:
    """Return the words of inverse kinematics with these overrides."""
    return ["ik", "inverse-kinematics", *(word for c in changes for word in ("--set", c))]


def dynamics(*changes: str) -> Words:
    """Return the words of inverse dynamics of barefoot trials with these overrides."""
    changes = ("conditions=[barefoot]", *changes)
    return ["id", "inverse-dynamics", *(word for c in changes for word in ("--set", c))]


def renamed_marker(path: Path) -> Path:
    """Write a marker set that names a marker which no recording has, beside a recording."""
    markers = (shipped("configs") / "markers.yaml").read_text(encoding="utf-8")
    path.with_name("markers.yaml").write_text(markers.replace("RTOE", "RBIG"), encoding="utf-8")
    return write_c3d(path)


FAULTS: dict[str, tuple[Callable[[Path], object], Words, tuple[str, ...]]] = {
    "missing file": (lambda path: None, imported(), (C3D, "no such recording")),
    "truncated": (cut, imported(), (C3D, "is cut off: 79 of its 120 frames are there")),
    "not a C3D": (text, imported(), (C3D, "not a C3D file")),
    "marker missing": (
        lambda path: write_c3d(path, without="LASI"),
        imported(),
        (C3D, "has no marker LASI; allowed: SACR, "),
    ),
    "a pose, no walk": (
        lambda path: write_c3d(path, frames=12),
        imported(),
        (C3D, "has 12 frames; allowed: at least 20"),
    ),
    "m called mm": (
        lambda path: write_c3d(path, scale=1.0),
        imported(),
        (C3D, "its markers span", "POINT:UNITS"),
    ),
    "folder that nobody can write": (
        write_c3d,
        imported("-o", "/proc/pathwalker"),
        ("/proc", "cannot be written"),
    ),
    "no recording named": (
        lambda path: None,
        kinematics(),
        ("inverse-kinematics: c3d", "names no C3D file of barefoot or orthosis"),
    ),
    "unknown key": (
        write_c3d,
        kinematics(f"c3d.barefoot=[{C3D}]", "longest_gaps=0.2"),
        ("--set longest_gaps=0.2: unknown key", "did you mean 'longest_gap'?"),
    ),
    "marker set of another lab": (
        renamed_marker,
        kinematics(f"c3d.barefoot=[{C3D}]", "markers=markers.yaml"),
        (C3D, "has no marker RBIG", "marker set"),
    ),
    "no force plates": (
        write_c3d,
        dynamics("source=c3d", f"c3d.barefoot=[{C3D}]"),
        ("walk: has no force plates that can be read; allowed: plates of types",),
    ),
    "cut-off below zero": (
        lambda path: None,
        dynamics("motion_cutoff=-6"),
        ("--set motion_cutoff=-6: is -6 Hz; allowed: 1 to 50 Hz",),
    ),
    "cut-off above half the frame rate": (
        lambda path: write_c3d(path, plate=True, rate=60.0),
        dynamics("source=c3d", f"c3d.barefoot=[{C3D}]", "motion_cutoff=40"),
        ("walk: motion_cutoff is 40 Hz", "allowed: less than 30 Hz", "set motion_cutoff lower"),
    ),
}
"""What is made in an empty folder, the words of the command, what its message says."""


@pytest.fixture(scope="module", autouse=True)
def _imported_once() -> None:
    """Let this process import what the commands need, before it is forked."""
    for words in (kinematics(), dynamics("motion_cutoff=-6"), imported("-o", "/proc/pathwalker")):
        assert CliRunner().invoke(cli, words).exit_code == 2


@pytest.mark.parametrize("fault", FAULTS)
def test_bad_input_is_one_sentence_and_leaves_nothing(fault: str, tmp_path: Path) -> None:
    make, words, said = FAULTS[fault]
    make(tmp_path / C3D)
    before = sorted(tmp_path.rglob("*"))
    done = called_apart(tmp_path, *words)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert done.stderr.endswith("\n")
    assert done.stderr.count("\n") == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert all(part in done.stderr for part in said), done.stderr
    assert sorted(tmp_path.rglob("*")) == before
