"""Commands killed at random moments: `python tests/kills.py [--kills N] [--only COMMAND ...]`.

Every command is run undisturbed once.  Then, in rounds, the same command is killed with all its
processes (SIGKILL) at a random moment, again and again, and at last let go on to its end.  After
every kill all files that have their final names must be whole, and what was solved stays as it is;
at the end tables must be those of the undisturbed run, and nothing is left over.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import yaml

from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.gait.motion_file import read_arrays
from pathwalker_cli.io.json_file import read_json
from pathwalker_cli.results.run_folder import load_run

PROGRAM: Final = [sys.executable, "-c", "from pathwalker_cli.cli import main; main()"]
MARK: Final = "PATHWALKER_KILLS"
"""Variable of the environment by which processes of a round are known, whoever their parent is."""

COARSE: Final = {"mesh.intervals": 8, "mesh.refinements": 0, "verdict": False}
LONGEST: Final = 900.0
"""Time after which a command hangs [s]."""


@dataclass(frozen=True)
class Command:
    """A command to kill.

    Args:
        words: Its words without `--out`.
        tables: Patterns of files that must come out the same, byte by byte but for times.
        journal: Pattern of files of which each, once there, is never made again.
        bases: Whether the words need the run that all studies stand on.
    """

    words: tuple[str, ...]
    tables: tuple[str, ...]
    journal: str = ""
    bases: bool = True


def settings(values: dict[str, Any]) -> list[str]:
    """Return words that override values of a config."""
    return [word for key, value in values.items() for word in ("--set", f"{key}={value}".lower())]


def study(name: str, **values: Any) -> tuple[str, ...]:
    """Return the words of a study around the base."""
    return (name, "perturbation" if name == "perturb" else name, "--run", "base",
            *settings(values))  # fmt: skip


_SPRINGS: Final = "[dorsiflexion_stiffness_left,plantarflexion_stiffness_left]"
_GRID: Final = {"dorsiflexion.points": 2, "plantarflexion.points": 2, "leaps": False, "sweeps": 1}
_BATCH: Final = Command(("batch", "study.yaml"), ("cases.csv", "cases/*/states.csv"),
                        "cases/*/motion.npz")  # fmt: skip

COMMANDS: Final[dict[str, Command]] = {
    "solve": Command(("solve", "mapd-healthy", "mapd-healthy", *settings(COARSE)), ("*.csv",)),
    "solve, starts": Command(("solve", "mapd-healthy", "mapd-healthy", *settings(COARSE), "--set",
                              "starts=2"), ("*.csv",)),
    "perturb": Command(study("perturb", springs=_SPRINGS), ("perturbation.csv",), "points/*.npz"),
    "landscape": Command(study("landscape", **_GRID), ("landscape.csv",), "points/*.npz"),
    "tradeoff": Command(
        study("tradeoff", walking_speed_weights="[0.9,1.1]", refine=False, sweeps=1),
        ("tradeoff.csv",), "points/*.npz"),
    "uncertainty": Command((*study("uncertainty", draws=3), "--workers", "2"),
                           ("uncertainty.csv", "draws.csv"), "draws/*.npz"),
    "batch": Command((*_BATCH.words, "--workers", "2"), _BATCH.tables, _BATCH.journal),
    "batch, Dask": Command((*_BATCH.words, "--scheduler"), _BATCH.tables, _BATCH.journal),
}  # fmt: skip


@dataclass
class Tally:
    """What was seen of a command."""

    kills: int = 0
    early: int = 0
    workers: int = 0
    rounds: int = 0
    kept: int = 0
    seconds: float = 0.0
    faults: list[str] = field(default_factory=list)


class Campaign:
    """Kills commands in a folder.

    Args:
        folder: Where everything goes.
        dice: Draws moments.
    """

    def __init__(self, folder: Path, dice: random.Random) -> None:
        self.folder = folder
        self.dice = dice
        self._environment = {
            **os.environ, "PATHWALKER_CACHE": str(folder / "cache"), "MPLBACKEND": "Agg",
            "OMP_NUM_THREADS": "1",
        }  # fmt: skip

    def prepare(self) -> None:
        """Solve the run that all studies stand on, and write the study of many cases."""
        words = ["solve", "mapd-orthosis", "mapd-orthosis", *settings(COARSE), "--out", "base"]
        self.ended(words)
        content = {"patients": ["sreenivasa2017-healthy"], "problems": ["mapd-healthy"],
                   "set": COARSE, "grid": {"bounds.friction": [0.6, 0.7, 0.8]}}  # fmt: skip
        (self.folder / "study.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")

    def begun(self, words: Sequence[str], mark: str = "none") -> subprocess.Popen[str]:
        """Return a command that runs in a session of its own."""
        return subprocess.Popen(
            [*PROGRAM, *words, "--quiet"], cwd=self.folder, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env={**self._environment, MARK: mark},
        )  # fmt: skip

    def ended(self, words: Sequence[str], mark: str = "none") -> tuple[int, str]:
        """Run a command to its end; return exit code and output."""
        process = self.begun(words, mark)
        try:
            output, _ = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return -1, f"hangs longer than {LONGEST:g} s"
        return process.returncode, output

    def attack(self, name: str, kills: int, burst: int) -> Tally:
        """Kill a command so often, in rounds of several kills each."""
        command, tally = COMMANDS[name], Tally()
        with self._cluster(name) as address:
            words = [*command.words, *address]
            whole = self.folder / f"whole-{list(COMMANDS).index(name)}"
            began = time.monotonic()
            code, output = self.ended([*words, "--out", whole.name])
            tally.seconds = time.monotonic() - began
            if code != 0:
                tally.faults.append(f"undisturbed: exit code {code}: {output}")
                return tally
            while tally.kills + tally.early < kills:
                try:
                    self._round(words, command, whole, burst, tally)
                except OSError as problem:  # files may go while they are looked at
                    tally.faults.append(repr(problem))
        return tally

    def _round(
        self, words: list[str], command: Command, whole: Path, burst: int, tally: Tally
    ) -> None:
        mark = uuid.uuid4().hex
        place = self.folder / f"round-{mark[:8]}"
        out = place / "out"
        place.mkdir()
        if not command.journal and self.dice.random() < 0.7:
            shutil.copytree(whole, out)  # a run that is to be replaced
        before = out.exists()
        left = tally.seconds
        for _ in range(burst):
            known = _stamps(out, command.journal)
            began = time.monotonic()
            if self._killed([*words, "--out", str(out)], out, mark, left, tally):
                tally.kills += 1
                left = max(0.3 * tally.seconds, left - 0.5 * (time.monotonic() - began))
            else:
                tally.early += 1
            self._look(out, before, tally)
            after = _stamps(out, command.journal)
            if not known.items() <= after.items():
                tally.faults.append(f"what was solved was solved again: {set(known) - set(after)}")
        tally.kept += len(_stamps(out, command.journal))
        known = _stamps(out, command.journal)
        code, output = self.ended([*words, "--out", str(out)], mark)
        tally.rounds += 1
        if code != 0:
            tally.faults.append(f"restart: exit code {code}: {output.strip()[-300:]}")
        if not known.items() <= _stamps(out, command.journal).items():
            tally.faults.append("the restart solved again what was solved")
        self._look(out, True, tally)
        tally.faults += _differences(whole, out, command.tables)
        tally.faults += [f"left over: {p.relative_to(place)}" for p in place.rglob(".*")]
        tally.faults += [f"left over: {p.name}" for p in place.iterdir() if p != out]
        tally.faults += [f"still runs: {pid}" for pid in _processes(mark)]
        shutil.rmtree(place)

    def _killed(self, words: list[str], out: Path, mark: str, seconds: float, tally: Tally) -> bool:
        """Run and kill a command; return whether it had not ended before."""
        process = self.begun(words, mark)
        worker = "batch" in words and self.dice.random() < 0.3
        moment = time.monotonic() + self.dice.uniform(0.0, seconds)
        writing = self.dice.random() < 0.35
        if writing:  # soon after the next file appears, whatever its name
            names = _names(out)
            while process.poll() is None and _names(out) <= names:
                time.sleep(0.001)
            moment = time.monotonic() + self.dice.uniform(0.0, 0.5)
        while process.poll() is None and time.monotonic() < moment:
            time.sleep(0.001)
        if process.poll() is not None:
            output = process.stdout.read() if process.stdout else ""
            if process.returncode != 0:
                tally.faults.append(f"exit code {process.returncode}: {output.strip()[-300:]}")
            return False
        if worker and (found := _workers(mark if "--scheduler" not in words else "dask")):
            os.kill(self.dice.choice(found), signal.SIGKILL)
            tally.workers += 1
            code = process.wait(LONGEST)
            if code != 0:
                output = process.stdout.read() if process.stdout else ""
                tally.faults.append(f"after a lost worker: exit code {code}: {output[-300:]}")
        else:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if process.stdout:
            process.stdout.close()
        return True

    def _look(self, out: Path, expected: bool, tally: Tally) -> None:
        """Note what is broken under a final name."""
        if expected and not (out.exists()):
            tally.faults.append("an earlier run is gone")
        for path in out.rglob("*"):
            if not any(part.startswith(".") for part in path.relative_to(out).parts):
                try:
                    whole(path)
                except Exception as problem:
                    tally.faults.append(f"{path.relative_to(out)}: {problem!r}")

    @contextmanager
    def _cluster(self, name: str) -> Iterator[list[str]]:
        """Yield the address of a scheduler with two workers for the command that needs one."""
        if "Dask" not in name:
            yield []
            return
        facts = self.folder / "scheduler.json"
        dask = [sys.executable, "-m", "dask"]
        environment = {**self._environment, MARK: "dask"}
        options: Any = {"cwd": self.folder, "env": environment, "stderr": subprocess.DEVNULL,
                        "stdout": subprocess.DEVNULL, "start_new_session": True}  # fmt: skip
        scheduler = subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0",
            "--dashboard-address", ":0", "--scheduler-file", facts], **options)  # fmt: skip
        workers = subprocess.Popen([*dask, "worker", "--nworkers", "2", "--nthreads", "1",
            "--dashboard-address", ":0", "--scheduler-file", facts], **options)  # fmt: skip
        try:
            end = time.monotonic() + 60.0
            while not facts.exists() and time.monotonic() < end:
                time.sleep(0.2)
            yield [json.loads(facts.read_text(encoding="utf-8"))["address"]]
        finally:
            for process in (workers, scheduler):
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def whole(path: Path) -> None:
    """Raise an exception if a file is not whole."""
    read = _READERS.get(path.suffix)
    if path.name == "metrics.json":
        try:
            load_run(path.parent)
        except NotConvergedError:
            load_run(path.parent, allow_unconverged=True)
    if read is not None:
        read(path)


def _table(path: Path) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        widths = {len(row) for row in csv.reader(file)}
    if len(widths) != 1 or not path.read_bytes().endswith(b"\n"):
        raise ValueError(f"rows of {widths} cells")


def _ends(end: bytes) -> Callable[[Path], None]:
    def read(path: Path) -> None:
        if end not in path.read_bytes()[-20:]:
            raise ValueError("is cut off")

    return read


_READERS: Final[dict[str, Callable[[Path], Any]]] = {
    ".json": read_json,
    ".npz": read_arrays,
    ".yaml": lambda path: yaml.safe_load(path.read_text(encoding="utf-8")),
    ".csv": _table,
    ".svg": _ends(b"</svg>"),
    ".png": _ends(b"IEND"),
}


def _names(folder: Path) -> set[str]:
    """Return all names in and beside a folder that may appear while something is written."""
    return {path.name for path in [*folder.parent.glob(".*"), *folder.rglob("*")]}


def _stamps(folder: Path, pattern: str) -> dict[str, tuple[int, int]]:
    """Return what tells whether files are still the same ones, by name."""
    found = {}
    for path in folder.glob(pattern) if pattern else ():
        if not any(part.startswith(".") for part in path.relative_to(folder).parts):
            status = path.stat()
            found[str(path.relative_to(folder))] = (status.st_ino, status.st_mtime_ns)
    return found


def _differences(one: Path, other: Path, patterns: Sequence[str]) -> list[str]:
    """Return the tables that differ in anything but times."""
    found = []
    for path in sorted(path for pattern in patterns for path in one.glob(pattern)):
        twin = other / path.relative_to(one)
        if not twin.is_file() or _rows(path) != _rows(twin):
            found.append(f"{path.relative_to(one)} differs from that of an undisturbed run")
    return found


def _rows(path: Path) -> bytes | list[list[str]]:
    """Return a table without its columns of seconds; as bytes if there are none."""
    content = path.read_bytes()
    rows = list(csv.reader(content.decode().splitlines()))
    kept = [i for i, head in enumerate(rows[0]) if not head.startswith("seconds")]
    return content if len(kept) == len(rows[0]) else [[row[i] for i in kept] for row in rows]


def _processes(mark: str) -> list[int]:
    """Return all processes that carry a mark, after a moment to end by themselves."""
    end = time.monotonic() + 10.0
    while (found := _marked(mark)) and time.monotonic() < end:
        time.sleep(0.2)
    return found


def _marked(mark: str) -> list[int]:
    wanted, found = f"{MARK}={mark}".encode(), []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if wanted in (path / "environ").read_bytes():
                found.append(int(path.name))
        except OSError:
            continue
    return found


def _workers(mark: str) -> list[int]:
    """Return the workers among the processes with a mark."""
    found = []
    for pid in _marked(mark):
        try:
            words = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        if b"spawn_main" in words:
            found.append(pid)
    return found


def main() -> None:
    """Kill all commands and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=20, metavar="N", help="per command")
    parser.add_argument("--burst", type=int, default=4, metavar="N", help="kills per restart")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=list(COMMANDS), metavar="COMMAND")
    options = parser.parse_args()
    print("command          kills  of workers  too late  restarts  kept  undisturbed [s]  faults")
    total = 0
    with tempfile.TemporaryDirectory(prefix="pathwalker-kills-") as folder:
        campaign = Campaign(Path(folder), random.Random(options.seed))
        campaign.prepare()
        for name in options.only or COMMANDS:
            tally = campaign.attack(name, options.kills, options.burst)
            total += len(tally.faults)
            print(
                f"{name:<15}{tally.kills:>7}{tally.workers:>12}{tally.early:>10}"
                f"{tally.rounds:>10}{tally.kept:>6}{tally.seconds:>17.1f}{len(tally.faults):>8}",
                flush=True,
            )
            for fault in tally.faults:
                print(f"    {fault}", flush=True)
    sys.exit(1 if total else 0)


if __name__ == "__main__":
    main()
