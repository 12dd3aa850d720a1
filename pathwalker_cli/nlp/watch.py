"""Watch the iterations of IPOPT, and stop it cleanly at Ctrl-C.

IPOPT runs in compiled code until it ends.  Relied on, of CasADi 3.8 with IPOPT 3.14: `nlpsol` calls
the `iteration_callback` with its own outputs, in the order of `nlpsol_out`, at the start and after
every iteration; and where that returns other than 0, IPOPT ends with `User_Requested_Stop`.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.program import Program


@dataclass(frozen=True)
class ProgressReport:
    """One iteration as it is shown.

    Args:
        iteration: Number of the iteration.
        objective: Value of the objective.
        infeasibility: Largest scaled violation of rows.
        elapsed: Seconds since the solve began.
    """

    iteration: int
    objective: float
    infeasibility: float
    elapsed: float


Observer = Callable[[ProgressReport], bool | None]
"""Hears of an iteration; a true answer ends the solve."""


class Watcher(ca.Callback):
    """Reports every iteration and ends the solve when asked to."""

    def __init__(self, program: Program, observer: Observer | None) -> None:
        ca.Callback.__init__(self)
        sizes = {"f": 1, "x": program.size, "lam_x": program.size}
        sizes |= {"g": program.rows, "lam_g": program.rows}
        sizes |= dict.fromkeys(("p", "lam_p"), program.parameters.size)
        self._sizes = [sizes[name] for name in ca.nlpsol_out()]
        self._observer = observer
        self.begin(program)
        self.construct("watcher", {})

    def begin(self, program: Program) -> None:
        """Get ready for a solve with the bounds of this program."""
        self._lower, self._upper = program.row_bounds
        self._start = time.perf_counter()
        self.iteration = -1
        self.stop = False

    def get_n_in(self) -> int:
        """Return the number of outputs of `nlpsol`."""
        return len(self._sizes)

    def get_n_out(self) -> int:
        """Return 1: whether to stop."""
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """Return that it is dense, and its length."""
        return ca.Sparsity.dense(self._sizes[i])

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        """Report an iterate; return whether to stop."""
        self.iteration += 1
        if self._observer is not None:
            given = dict(zip(ca.nlpsol_out(), arguments, strict=True))
            g = np.asarray(given["g"]).ravel()
            worst = float(np.maximum(self._lower - g, g - self._upper).max(initial=0.0))
            elapsed = time.perf_counter() - self._start
            report = ProgressReport(self.iteration, float(given["f"]), worst, elapsed)
            if self._observer(report):
                self.stop = True
        return [int(self.stop)]


@contextmanager
def interruptible(watcher: Watcher) -> Iterator[None]:
    """Let Ctrl-C end the solve after the current iteration; a second one interrupts at once."""

    def handler(number: int, frame: FrameType | None) -> None:
        if watcher.stop:
            if callable(previous):
                previous(number, frame)
            raise KeyboardInterrupt
        watcher.stop = True

    try:
        previous = signal.signal(signal.SIGINT, handler)
    except ValueError:  # not in the main thread: leave the signal alone
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
