"""Kills at every step of a write, full disks, two processes in one folder, clocks that jump."""

from __future__ import annotations

import errno
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from conftest import MadeSolution, made_result
from helpers import GUARD
from kills import whole
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.errors import DataError
from pathwalker_cli.io import atomic
from pathwalker_cli.io.atomic import atomic_open, check_room, sweep
from pathwalker_cli.io.json_file import read_json, write_json
from pathwalker_cli.io.lock import locked
from pathwalker_cli.nlp import tape_store
from pathwalker_cli.results import run_folder
from pathwalker_cli.results.metrics import run_inputs
from pathwalker_cli.results.run_folder import claimed_run, load_run, release_runs, write_run
from pathwalker_cli.studies import neighbours
from pathwalker_cli.studies import run as studies_run
from pathwalker_cli.studies.base import claimed_folder
from pathwalker_cli.studies.run import run_study

EVENTS = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "ctypes.dlsym"}
"""What the interpreter tells of all that changes a disk, beside files that are opened to be
written; the last is a call of the system."""


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())


def killed_at_every_step(act: Callable[[], Any], look: Callable[[], Any]) -> int:
    """Kill a fork of this process at its first touch of the disk, its second, and so on.

    Args:
        act: What the fork does.
        look: Is called after every kill.

    Returns:
        How often it was killed before it came to its end.
    """
    for step in range(1, 1000):
        child = os.fork()
        if child == 0:
            left = [step]

            def hook(event: str, told: Any, left: list[int] = left) -> None:
                opened = event == "open" and isinstance(told[2], int) and told[2] & os.O_CREAT
                if opened or event in EVENTS:
                    left[0] -= 1
                    if left[0] == 0:
                        os.kill(os.getpid(), signal.SIGKILL)

            sys.addaudithook(hook)
            code = 1
            try:
                act()
                code = 0
            finally:
                os._exit(code)
        _, status = os.waitpid(child, 0)
        look()
        if os.waitstatus_to_exitcode(status) == 0:
            return step - 1
        assert os.waitstatus_to_exitcode(status) == -signal.SIGKILL
    raise AssertionError("never came to an end")


def left_over(folder: Path) -> list[str]:
    """Return the names of everything hidden."""
    return [path.name for path in folder.rglob(".*")]


def small_table(path: Path, _: Any) -> None:
    """Write a table as all tables are written, but at once."""
    with atomic_open(path) as file:
        file.write("time [s]\n0\n")


@pytest.mark.parametrize("exchange", ["in one stroke", "in two steps"])
def test_a_write_of_a_run_killed_at_any_step_leaves_the_old_run_or_the_new_one(
    tmp_path: Path,
    made_solution: MadeSolution,
    monkeypatch: pytest.MonkeyPatch,
    exchange: str,
) -> None:
    run, seen = tmp_path / "runs" / "run", set()
    solution = made_solution(cost=0.9)
    metrics = run_folder.run_metrics(solution, run_inputs(solution.case))
    monkeypatch.setattr(
        run_folder, "run_metrics", lambda made, *_: metrics.model_copy(update={"cost": made.cost})
    )
    monkeypatch.setattr(run_folder, "TABLES", dict.fromkeys(run_folder.TABLES, small_table))
    if exchange == "in two steps":
        monkeypatch.setattr(run_folder, "swapped", lambda *_: False)
    write_run(run, made_solution(cost=0.4))

    def act() -> None:
        with claimed_run(run):
            write_run(run, solution)

    def look() -> None:
        if exchange == "in one stroke":
            load_run(run)  # what was finished is there all the time
        release_runs(run.parent)
        assert not left_over(tmp_path)
        seen.add(load_run(run).metrics["cost"])

    assert killed_at_every_step(act, look) > 15
    assert seen == {0.4, 0.9}


def test_other_files_killed_at_any_step_are_old_or_new(tmp_path: Path) -> None:
    path, seen = tmp_path / "points" / "point.npz", []
    write_json(tmp_path / "study.json", {"made": 1})

    def act() -> None:
        with claimed_folder(tmp_path, frozenset({"points", "study.json"}), "perturb"):
            neighbours._write(path, "seal", made_result())
            write_json(tmp_path / "study.json", {"made": 2})

    def look() -> None:
        with claimed_folder(tmp_path, frozenset({"points", "study.json"}), "perturb"):
            pass
        assert not left_over(tmp_path)
        seen.append((path.exists(), read_json(tmp_path / "study.json")["made"]))
        assert not path.exists() or neighbours._read(path, "seal") is not None

    assert killed_at_every_step(act, look) >= 8
    assert list(dict.fromkeys(seen)) == [(False, 1), (True, 1), (True, 2)]


COMMAND = "from pathwalker_cli.cli import main; main()"


def test_a_solve_killed_at_random_leaves_nothing_half_written(tmp_path: Path) -> None:
    """The long campaign of all commands is `python tests/kills.py`."""
    dice = random.Random(0)
    words = ["solve", "mapd-healthy", "mapd-healthy", "--smoke", "--out", "run"]
    for _ in range(2):
        with subprocess.Popen(
            [sys.executable, "-c", COMMAND, *words],
            cwd=tmp_path, start_new_session=True, stderr=subprocess.DEVNULL,
        ) as process:  # fmt: skip
            time.sleep(dice.uniform(0.5, 2.5))
            os.killpg(process.pid, signal.SIGKILL)
        for path in tmp_path.rglob("[!.]*"):
            whole(path)
    release_runs(tmp_path)
    assert not left_over(tmp_path)


# Locks


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Callable[[Path], subprocess.Popen[str]]]:
    """Return what starts another process that holds a file."""
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom pathwalker_cli.io.lock import locked\n"
        "with locked(Path(sys.argv[1]), Path()):\n    print('held', flush=True)\n"
        "    time.sleep(float(sys.argv[2]))\n"
    )
    begun: list[subprocess.Popen[str]] = []

    def hold(file: Path, seconds: float = 2.0 * GUARD) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", script, file, str(seconds)], stdout=subprocess.PIPE, text=True
        )
        begun.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        return process

    yield hold
    for process in begun:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()


def test_a_second_process_is_refused_until_the_first_one_dies(
    tmp_path: Path, other: Callable[..., subprocess.Popen[str]]
) -> None:
    first = other(tmp_path / "runs" / ".run.lock")
    with pytest.raises(DataError, match=r"run: another `pathwalker` is at work there; wait"):
        claimed_run(tmp_path / "runs" / "run").__enter__()
    first.kill()
    first.wait()
    with claimed_run(tmp_path / "runs" / "run"):
        pass
    assert not left_over(tmp_path)


def test_a_worker_waits_for_another_one(
    tmp_path: Path, other: Callable[..., subprocess.Popen[str]]
) -> None:
    first = other(tmp_path / ".run.lock", 1.0)
    with claimed_run(tmp_path / "run", wait=True):
        assert first.wait(GUARD) == 0
    assert not left_over(tmp_path)


@pytest.mark.parametrize(
    ("words", "lock"),
    [
        (["solve", "mapd-healthy", "mapd-healthy", "--smoke"], ".out.lock"),
        *[([study, "perturbation" if study == "perturb" else study, "--run", "nowhere"],
           "out/.lock") for study in ("perturb", "sensitivity", "uncertainty", "landscape",
                                      "tradeoff")],
        (["batch", "cohort"], "out/.lock"),
        (["reproduce", "--quick"], "out/.lock"),
    ],
)  # fmt: skip
def test_every_command_refuses_a_folder_in_which_another_one_works(
    tmp_path: Path,
    other: Callable[..., subprocess.Popen[str]],
    words: list[str],
    lock: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    other(Path(lock))
    result = CliRunner().invoke(cli, [*words, "--out", "out"])
    assert result.exit_code == 2
    assert result.output.startswith("Error: out: another `pathwalker` is at work there; wait until")
    assert result.output.count("\n") == 1


def test_a_lock_takes_away_the_folders_made_for_it_unless_they_are_used(tmp_path: Path) -> None:
    with locked(tmp_path / "a" / "b" / ".lock", tmp_path):
        pass
    assert not (tmp_path / "a").exists()
    with locked(tmp_path / "a" / "b" / ".lock", tmp_path):
        (tmp_path / "a" / "kept").touch()
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["kept"]


def test_disks_without_locks_keep_nobody_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flock(*_: Any) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", flock)
    with locked(tmp_path / ".lock", tmp_path), locked(tmp_path / ".lock", tmp_path):
        pass
    assert not left_over(tmp_path)


def test_only_own_leftovers_are_swept(tmp_path: Path) -> None:
    mine = tmp_path / "points" / ".a.npz.0123abcd.tmp"
    mine.parent.mkdir()
    others = [tmp_path / name for name in (".git", ".notes.tmp", "a.0123abcd.tmp", ".a.b.tmp")]
    for path in (mine, *others):
        path.touch()
    sweep(tmp_path, deep=True)
    assert not mine.exists()
    assert all(path.exists() for path in others)


# Disks


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Return a disk of 200 kB; tests without the right to mount one are skipped."""
    place = tmp_path / "disk"
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(place)]
    if os.geteuid() != 0 or shutil.which("mount") is None or subprocess.call(words) != 0:
        pytest.skip("needs the right to mount a disk")
    yield place
    subprocess.check_call(["umount", "-l", str(place)])


def test_a_full_disk_is_refused_before_the_work(small_disk: Path) -> None:
    words = ["solve", "mapd-healthy", "mapd-healthy", "--smoke", "--out", str(small_disk / "run")]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    assert "run: is on a full disk: 0.2 MB are free; allowed: 10 MB or more; make" in result.output
    assert not list(small_disk.iterdir())


def test_a_disk_that_fills_up_loses_no_solution(
    small_disk: Path,
    tmp_path: Path,
    made_solution: MadeSolution,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(atomic, "_LEAST_ROOM", 0)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(studies_run, "_solve", lambda *_: made_solution(cost=0.7))
    monkeypatch.setattr(studies_run, "verdict_of", lambda _: None)
    (small_disk / "film.mp4").write_bytes(bytes(150_000))
    run = small_disk / "run"
    with pytest.raises(DataError, match="No space left on device; the run is kept in") as caught:
        run_study(load_config("mapd-orthosis"), run)
    assert [path.name for path in small_disk.rglob("*")] == ["film.mp4"]
    kept = Path(str(caught.value).split("is kept in ")[1].split(":")[0])
    assert load_run(kept).metrics["cost"] == 0.7
    assert kept.name == "run"


@pytest.mark.parametrize("write", [
    lambda path: neighbours._write(path, "seal", made_result()),
    lambda path: write_json(path, {"text": "x" * 300_000}),
])  # fmt: skip
def test_a_file_on_a_full_disk_is_named_and_not_half_there(
    small_disk: Path, write: Callable[[Path], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = small_disk / "made"
    path.write_text("old")
    film = os.open(small_disk / "film.mp4", os.O_CREAT | os.O_WRONLY)
    with suppress(OSError):
        while os.write(film, bytes(1000)):
            pass
    os.close(film)
    with pytest.raises(OSError, match=r"No space left on device: .*made'"):
        write(path)
    assert path.read_text() == "old"
    assert sorted(p.name for p in small_disk.iterdir()) == ["film.mp4", "made"]


def test_an_error_of_the_disk_is_told_with_its_place_and_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        with atomic_open(tmp_path / "points.npz"):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathwalker_cli.commands.solve._case", fail)
    result = CliRunner().invoke(cli, ["solve", "mapd-healthy", "mapd-healthy"])
    expected = f"Error: {tmp_path}/points.npz: No space left on device; make room, then call again"
    assert result.output.strip() == expected
    assert result.exit_code == 2


def read_only(folder: Path) -> None:
    """Make a disk read-only."""
    subprocess.check_call(["mount", "-o", "remount,ro", str(folder)])


@pytest.mark.parametrize("words", [
    ["solve", "mapd-healthy", "mapd-healthy", "--smoke"],
    ["perturb", "perturbation"], ["landscape", "landscape"], ["batch", "cohort"],
])  # fmt: skip
def test_a_read_only_disk_is_refused_before_the_work(small_disk: Path, words: list[str]) -> None:
    read_only(small_disk)
    result = CliRunner().invoke(cli, [*words, "--out", str(small_disk / "out")])
    assert result.exit_code == 2
    assert result.output.startswith(f"Error: {small_disk}")
    assert result.output.count("\n") == 1
    assert "; choose another --out" in result.output or "make room" in result.output


@pytest.mark.parametrize("cache", ["full", "read-only", "file", "pipe", "below a file"])
def test_no_cache_is_no_failure(
    small_disk: Path, tmp_path: Path, cache: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = small_disk
    if cache == "full":
        (folder / "film.mp4").write_bytes(bytes(190_000))
    elif cache == "read-only":
        read_only(folder)
    else:
        folder = tmp_path / "cache"
        os.mkfifo(folder) if cache == "pipe" else folder.touch()
        folder = folder / "below" if cache == "below a file" else folder
    monkeypatch.setenv("PATHWALKER_CACHE", str(folder))
    ones = np.zeros((40_000, 4), np.int32)
    tape = tape_store.Tape(ones, 1, ones[:1], ones[:1], ())
    tape_store.keep_tapes("structure", {"block": (1, {"value": tape})})
    assert tape_store.kept_tapes("structure") is None
    assert not list(small_disk.glob("*.part"))


def test_a_pipe_in_the_cache_does_not_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATHWALKER_CACHE", str(tmp_path))
    path = tape_store._path("structure")
    assert path is not None
    os.mkfifo(path)
    assert tape_store.kept_tapes("structure") is None


def test_room_is_asked_for_below_folders_that_do_not_exist_yet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    check_room(Path("runs") / "new" / "run")
    monkeypatch.setattr(atomic, "_LEAST_ROOM", 1 << 60)
    with pytest.raises(DataError, match="runs/new/run: is on a full disk"):
        check_room(Path("runs") / "new" / "run")


# Clocks


def test_a_clock_that_jumps_back_changes_no_result_but_the_date(
    tmp_path: Path, made_solution: MadeSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Past(datetime):
        @classmethod
        def now(cls, tz: Any = UTC) -> datetime:
            return datetime(1999, 12, 31, tzinfo=tz)

    write_run(tmp_path / "today", made_solution())
    monkeypatch.setattr("time.time", lambda: 0.0)
    monkeypatch.setattr("pathwalker_cli.versions.datetime", Past)
    write_run(tmp_path / "past", made_solution())
    ours, theirs = (load_run(tmp_path / name).metrics for name in ("past", "today"))
    assert ours.pop("date") == "1999-12-31"
    assert ours.pop("date") if "date" in ours else theirs.pop("date")
    for key in ("seconds_verify", "metrics_hash"):
        ours.pop(key), theirs.pop(key)
    assert ours == theirs


def test_nothing_reads_the_clock_of_the_wall_but_for_dates() -> None:
    package = Path(atomic.__file__).parent.parent
    told = {"versions.py", "reproduce/pipeline.py", "report/runs.py"}
    found = {
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        if any(word in path.read_text(encoding="utf-8") for word in ("time.time(", "datetime."))
    }
    assert found <= told, "durations are differences of time.perf_counter or time.monotonic"


# Workers and Ctrl-C

POOL = """
import os, signal, sys, time
from pathlib import Path
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.io.processes import results_of_calls

def work(seconds):
    if seconds < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(seconds)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start jobs deaf
    print("begun", flush=True)
    try:
        list(results_of_calls(work, [(float(word),) for word in sys.argv[1:]], 2))
    except KeyboardInterrupt:
        print("stopped", flush=True)
    except NotConvergedError as error:
        print(error, flush=True)
"""


def pool(folder: Path, *seconds: float) -> subprocess.Popen[str]:
    """Return a process whose two workers sleep, or die where the seconds are negative."""
    (folder / "pool.py").write_text(POOL, encoding="utf-8")
    words = [sys.executable, folder / "pool.py", *map(str, seconds)]
    return subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )


@pytest.mark.parametrize("delay", [0.1, 0.5, 2.0])
def test_ctrl_c_at_any_time_ends_all_workers_in_one_line(tmp_path: Path, delay: float) -> None:
    with pool(tmp_path, *[2.0 * GUARD] * 3) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=GUARD)
    assert output == "stopped\n"


def test_a_worker_that_is_lost_is_told(tmp_path: Path) -> None:
    with pool(tmp_path, 0, -1, 2.0 * GUARD) as process:
        output, _ = process.communicate(timeout=GUARD)
    assert output.startswith("begun\na process was ended from outside (out of memory?)")
    assert output.count("\n") == 2
