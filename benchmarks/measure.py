"""Run commands and functions in fresh processes; tell what they cost.

This process stays small on purpose: on Linux a child's peak memory starts at that of its parent.
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

__all__ = [
    "Cost",
    "Finished",
    "PartFailedError",
    "Sample",
    "command",
    "fresh",
    "pathwalker",
    "sample_of",
]

HERE: Final = Path(__file__).parent
ONE_THREAD: Final = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
CACHE: Final = "PATHWALKER_CACHE"
"""Folder in which the program keeps derivative functions; "off" for none."""

TIME_LIMIT: Final = 3600.0
"""Seconds after which a part is given up."""


class PartFailedError(Exception):
    """A part of the suite did not come to an end; the message says why."""


@dataclass(frozen=True)
class Cost:
    """What a process and all it started took.

    Args:
        cpu: CPU seconds, user and system, of the process and of those it waited for.
        wall: Wall seconds.
        peak: Peak memory of the largest of these processes [MB].
    """

    cpu: float
    wall: float
    peak: float


@dataclass(frozen=True)
class Finished:
    """A command that ended.

    Args:
        code: Exit code.
        output: What it wrote to standard output.
        errors: What it wrote to standard error.
        cost: What it took.
    """

    code: int
    output: str
    errors: str
    cost: Cost


@dataclass(frozen=True)
class Sample:
    """One figure, measured several times."""

    values: tuple[float, ...]

    @classmethod
    def of(cls, values: Iterable[float]) -> Sample:
        """Return the sample of these values."""
        return cls(tuple(float(value) for value in values))

    @property
    def median(self) -> float:
        """The median."""
        return statistics.median(self.values)

    def scaled(self, factor: float) -> Sample:
        """Return the same in other units."""
        return Sample(tuple(factor * value for value in self.values))


def command(
    arguments: Sequence[str | Path],
    cache: Path | str = "off",
    allowed: Sequence[int] = (0,),
    time_limit: float = TIME_LIMIT,
) -> Finished:
    """Run a command in a process of its own, on one thread.

    Args:
        arguments: The command.
        cache: Folder for derivative functions, or "off".
        allowed: Exit codes that are no failure.
        time_limit: Seconds after which it is ended.

    Raises:
        PartFailedError: If it fails or takes too long.
    """
    words = [str(word) for word in arguments]
    settings = {**dict.fromkeys(ONE_THREAD, "1"), CACHE: str(cache), "MPLBACKEND": "Agg"}
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        began = time.perf_counter()
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=errors,
            env={**os.environ, **settings},
            start_new_session=True,
        )
        usage, late = _waited(process, time_limit)
        wall = time.perf_counter() - began
        for file in (output, errors):
            file.seek(0)
        cost = Cost(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024)
        finished = Finished(process.returncode, output.read(), errors.read(), cost)
    if late:
        raise PartFailedError(f"given up after {time_limit:g} s")
    if finished.code not in allowed:
        lines = (finished.errors or finished.output).strip().splitlines() or ["no message"]
        raise PartFailedError(f"exit code {finished.code}: {lines[-1]}")
    return finished


def _waited(process: subprocess.Popen[str], time_limit: float) -> tuple[Any, bool]:
    """Wait for a process; return its resource usage, and whether it had to be ended."""
    late = threading.Event()

    def end() -> None:
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    timer = threading.Timer(time_limit, end)
    timer.start()
    try:
        _, status, usage = os.wait4(process.pid, 0)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    finally:
        timer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage, late.is_set()


def pathwalker(
    *arguments: str | Path, cache: Path | str = "off", allowed: Sequence[int] = (0,)
) -> Finished:
    """Run `pathwalker` of this environment."""
    program = Path(sys.executable).parent / "pathwalker"
    return command([program, *arguments], cache, allowed)


def fresh(part: str, cache: Path | str = "off", **arguments: Any) -> tuple[dict[str, Any], Cost]:
    """Call a function in a fresh process.

    Args:
        part: Module below `parts` and function, e.g. "building:steps".
        cache: Folder for derivative functions, or "off".
        arguments: Its arguments, as JSON knows them.

    Returns:
        Its result, as JSON knows it, and what the process took.

    Raises:
        PartFailedError: If it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.json"
        words = [sys.executable, HERE / "worker.py", part, json.dumps(arguments), result]
        finished = command(words, cache)
        return json.loads(result.read_text(encoding="utf-8")), finished.cost


def sample_of(rows: Sequence[Mapping[str, float]], key: str) -> Sample:
    """Return one figure of all repetitions."""
    return Sample.of(row[key] for row in rows)
