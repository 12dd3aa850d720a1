"""Tapes on disk: found again, never stale, never harmful."""

from __future__ import annotations

import multiprocessing
import os
from pathlib import Path

import numpy as np
import pytest

from pathwalker_cli.config import load_config
from pathwalker_cli.ocp import tape_store
from pathwalker_cli.ocp.kernels import kernels
from pathwalker_cli.ocp.solve import GaitSolver
from pathwalker_cli.ocp.structures import gait_blocks
from pathwalker_cli.ocp.tape import Tape
from pathwalker_cli.ocp.tape_store import cache_folder, keep_tapes, kept_tapes

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


BLOCKS = [{"values": tape(1), "hessian": tape(2)}, {"values": tape(3)}]


def file_of(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def test_what_was_kept_is_found_again(folder: Path) -> None:
    assert kept_tapes("a") is None
    keep_tapes("a", BLOCKS)
    found = kept_tapes("a")
    assert found is not None
    assert [list(block) for block in found] == [list(block) for block in BLOCKS]
    for block, again in zip(BLOCKS, found, strict=True):
        assert all(same(block[kind], again[kind]) for kind in block)
    assert kept_tapes("b") is None


def test_other_code_or_versions_find_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_tapes("a", BLOCKS)
    monkeypatch.setattr(tape_store, "_makers", lambda: "other code")
    assert kept_tapes("a") is None


def test_all_sources_of_problems_are_in_the_name() -> None:
    names = {path.name for path in tape_store._maker_files()}
    assert {"conventions.py", "gait.py", "curves.py", "frozen.py", "tape.py", "blocks.py"} <= names
    assert "libkernels-generic.so" in names


@pytest.mark.parametrize("harm", ["truncated", "flipped", "empty", "foreign", "folder"])
def test_a_damaged_file_is_made_again(folder: Path, harm: str) -> None:
    keep_tapes("a", BLOCKS)
    file = file_of(folder)
    content = bytearray(file.read_bytes())
    if harm == "flipped":
        content[content.index(b"numbers.npy") + 200] ^= 0xFF
    elif harm == "truncated":
        content = content[: len(content) // 2]
    elif harm == "foreign":
        content = bytearray(b"not an archive")
    file.unlink()
    if harm == "folder":
        file.mkdir()
    else:
        file.write_bytes(b"" if harm == "empty" else bytes(content))
    assert kept_tapes("a") is None
    keep_tapes("a", BLOCKS)
    assert (kept_tapes("a") is None) == (harm == "folder")
    assert list(folder.iterdir()) == [file]


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
    assert cache_folder() == Path.home() / ".cache" / "pathwalker"


def test_a_folder_that_cannot_be_written_does_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PATHWALKER_CACHE", str(tmp_path / "file" / "cache"))
    keep_tapes("a", BLOCKS)
    assert kept_tapes("a") is None


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
    config = load_config("mapd-barefoot", changes=("mesh.intervals=16",))
    solver = GaitSolver(config)
    made = gait_blocks.__globals__["_BUILT"]
    monkeypatch.setitem(gait_blocks.__globals__, "_BUILT", {})
    first = gait_blocks(solver.gait, 3)
    assert file_of(folder).suffix == ".npz"
    monkeypatch.setitem(gait_blocks.__globals__, "_BUILT", {})
    monkeypatch.setattr(Tape, "of", lambda function: pytest.fail("derived again"))
    again = gait_blocks(solver.gait, 3)
    for block, other in zip(first.blocks, again.blocks, strict=True):
        assert block.tapes is not None
        assert other.tapes is not None
        assert all(same(block.tapes[kind], other.tapes[kind]) for kind in block.tapes)
    assert made is not None
