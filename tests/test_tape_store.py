"""Tapes on disk: found again, never stale, never harmful."""

from __future__ import annotations

import errno
import multiprocessing
import os
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import pathwalker_cli
from pathwalker_cli.case import load_case
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait import problem
from pathwalker_cli.gait.problem import gait_blocks
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp import tape_store
from pathwalker_cli.nlp.assembly import KINDS
from pathwalker_cli.nlp.blocks import Expressions
from pathwalker_cli.nlp.kernels import kernels, kernels_path
from pathwalker_cli.nlp.tape import Tape
from pathwalker_cli.nlp.tape_store import cache_folder, keep_tapes, kept_tapes
from pathwalker_cli.ocp.collocation import CollocationProgram

pytestmark = pytest.mark.skipif(
    kernels() is None and bool(os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON")),
    reason="no compiler was there when the package was installed",
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PATHWALKER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def tape(seed: int) -> Tape:
    rng = np.random.default_rng(seed)
    table = lambda rows, columns: rng.integers(0, 9, (rows, columns)).astype(np.int32)  # noqa: E731
    return Tape(table(5, 4), 7, table(3, 2), table(2, 2), (table(2, 2), table(0, 2)))


def same(a: Tape, b: Tape) -> bool:
    arrays = ((t.code, t.inputs, t.outputs, *t.patterns) for t in (a, b))
    return a.registers == b.registers and all(map(np.array_equal, *arrays))


BLOCKS = {"a": (4, {"values": tape(1), "hessian": tape(2)}), "b": (0, {"values": tape(3)})}


def file_of(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def test_what_was_kept_is_found_again(folder: Path) -> None:
    assert kept_tapes("a") is None
    keep_tapes("a", BLOCKS)
    found = kept_tapes("a")
    assert found is not None
    assert list(found) == list(BLOCKS)
    for name, (rows, tapes) in BLOCKS.items():
        assert found[name][0] == rows
        assert all(same(tapes[kind], found[name][1][kind]) for kind in tapes)
    assert kept_tapes("b") is None


def test_other_code_or_versions_find_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_tapes("a", BLOCKS)
    monkeypatch.setattr(tape_store, "_made_by", lambda makers: "other code")
    assert kept_tapes("a") is None


def test_other_versions_have_another_name(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pin.__version__ in problem._MAKERS
    names = [tape_store._made_by.__wrapped__(makers) for makers in (("1.0",), ("0.0",))]
    monkeypatch.setattr(np, "__version__", "0.0")
    names.append(tape_store._made_by.__wrapped__(("1.0",)))
    assert None not in names
    assert len(set(names)) == 3


def test_sources_and_libraries_are_in_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    package = Path(pathwalker_cli.__file__).parent
    files = list(tape_store._maker_files(package, problem._MAKERS))
    assert {*package.rglob("*.py")} < {*files}
    assert {file.name for file in files if file.suffix == ".so"} == {
        kernels_path().name,
        "libpinocchio_casadi.so",
    }
    before = tape_store._made_by.__wrapped__()
    read = Path.read_bytes
    end = {files[3]: b"# changed"}
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + end.get(path, b""))
    assert tape_store._made_by.__wrapped__() not in (before, None)


def test_other_structures_have_another_name(folder: Path) -> None:
    solvers = [GaitSolver(load_case(name)) for name in ("mapd-barefoot", "mapd-orthosis")]
    keys = [(solver.gait.structure, degree) for solver in solvers for degree in (3, 4)]
    assert len({tape_store._path(key) for key in keys}) == 4
    again = GaitSolver(load_case("mapd-barefoot", changes=("bounds.friction=0.3",)))
    assert tape_store._path((again.gait.structure, 3)) == tape_store._path(keys[0])


def test_sources_that_changed_under_a_process_are_not_trusted(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What runs may be what the file was, so that nothing must be kept under its new name."""
    monkeypatch.setattr(tape_store, "_made_by", tape_store._made_by.__wrapped__)
    keep_tapes("a", BLOCKS)
    assert kept_tapes("a") is not None
    now = pathwalker_cli.SOURCES
    changed = {path: (ino, size, time - 1) for path, (ino, size, time) in now.items()}
    monkeypatch.setattr(pathwalker_cli, "SOURCES", changed)
    assert kept_tapes("a") is None
    keep_tapes("b", BLOCKS)
    assert len(list(folder.iterdir())) == 1


@pytest.mark.parametrize("harm", ["truncated", "flipped", "empty", "foreign", "moved", "folder"])
def test_a_damaged_file_is_made_again(folder: Path, harm: str) -> None:
    keep_tapes("a", BLOCKS)
    file = file_of(folder)
    content = bytearray(file.read_bytes())
    if harm == "flipped":
        content[len(content) // 2] ^= 0x10
    elif harm == "truncated":
        content = content[: len(content) // 2]
    elif harm == "foreign":
        content = bytearray(b"not tapes")
    elif harm == "moved":
        file.unlink()
        keep_tapes("b", BLOCKS)
        file_of(folder).rename(file)
        content = bytearray(file.read_bytes())
    file.unlink()
    if harm == "folder":
        file.mkdir()
    else:
        file.write_bytes(b"" if harm == "empty" else bytes(content))
    assert kept_tapes("a") is None
    keep_tapes("a", BLOCKS)
    assert (kept_tapes("a") is None) == (harm == "folder")
    assert list(folder.iterdir()) == [file]


def test_any_flipped_byte_is_noticed(folder: Path) -> None:
    keep_tapes("a", BLOCKS)
    file = file_of(folder)
    content = file.read_bytes()
    for i in range(len(content)):
        file.write_bytes(content[:i] + bytes([content[i] ^ 0x81]) + content[i + 1 :])
        assert kept_tapes("a") is None


@pytest.mark.parametrize("value", ["", "off"])
def test_it_can_be_switched_off(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATHWALKER_CACHE", value)
    assert cache_folder() is None
    keep_tapes("a", BLOCKS)
    assert kept_tapes("a") is None


def test_the_user_s_cache_is_the_default(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("PATHWALKER_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "pathwalker"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "pathwalker"
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # nobody's home
    assert cache_folder() is None


def test_a_folder_that_cannot_be_written_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PATHWALKER_CACHE", str(tmp_path / "file" / "cache"))
    keep_tapes("a", BLOCKS)
    assert kept_tapes("a") is None


def test_a_full_disk_does_no_harm(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*paths: object) -> None:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "replace", full)
    keep_tapes("a", BLOCKS)
    assert list(folder.iterdir()) == []


def test_only_the_files_used_last_stay(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tape_store, "_MOST_FILES", 2)
    for age, name in ((30, "a"), (20, "b"), (10, "c")):
        before = set(folder.glob("*")) if folder.exists() else set()
        keep_tapes(name, BLOCKS)
        for file in set(folder.glob("*")) - before:
            os.utime(file, (file.stat().st_mtime - age, file.stat().st_mtime - age))
    kept_tapes("a")
    keep_tapes("d", BLOCKS)
    assert len(list(folder.iterdir())) == 2
    assert kept_tapes("d") is not None


def _keep(name: str) -> bool:
    for _ in range(20):
        keep_tapes(name, BLOCKS)
        if kept_tapes(name) is None:
            return False
    return True


def test_processes_that_start_at_once_do_not_disturb_each_other(folder: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert all(pool.map(_keep, ["a", "a"]))
    assert len(list(folder.iterdir())) == 1


def test_a_further_process_derives_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = load_case("mapd-barefoot", changes=("mesh.intervals=16",))
    solver = GaitSolver(case)
    monkeypatch.setitem(gait_blocks.__globals__, "_BUILT", {})
    first = gait_blocks(solver.gait, 3)
    assert file_of(folder).suffix == ".tapes"
    monkeypatch.setitem(gait_blocks.__globals__, "_BUILT", {})
    monkeypatch.setattr(Tape, "of", lambda function: pytest.fail("derived again"))
    monkeypatch.setattr(Expressions, "_function", lambda *inputs: pytest.fail("built again"))
    again = gait_blocks(solver.gait, 3)
    meshes = meshing.first(solver.stride.durations, solver.config.mesh)
    assert CollocationProgram(again, solver.prediction, meshes).functions
    monkeypatch.undo()
    for block, other in zip(first.blocks, again.blocks, strict=True):
        assert block.kept is None
        assert other.kept is not None
        assert (block.name, block.rows, block.matters) == (other.name, other.rows, other.matters)
        for kind in KINDS if block.matters else ():
            assert same(block.tapes[kind], other.tapes[kind])
            assert block.functions[kind].serialize() == other.functions[kind].serialize()
