"""Live progress: one moving line or a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, TaskID, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.text import Text

from pathwalker_cli.studies.batch.study import Watch
from pathwalker_cli.studies.run import RunLog

if TYPE_CHECKING:
    from pathwalker_cli.gait.solution import LocalOptimum
    from pathwalker_cli.nlp.watch import ProgressReport
    from pathwalker_cli.studies.batch.ledger import Ended

EVERY: Final = 20
"""Iterations between two plain lines."""
PAUSE: Final = 0.1
"""Least time between two redraws of the live line [s]."""


class _Lines:
    """Where lines of progress are shown."""

    def __init__(self, quiet: bool, console: Console | None) -> None:
        self.console = console or Console(stderr=True)
        self.quiet = quiet
        self.live = self.console.is_terminal and not quiet

    def print(self, line: str, style: str = "dim") -> None:
        """Show a line."""
        if not self.quiet:
            self.console.print(Text(line, style=style), soft_wrap=True)


class Progress(RunLog):
    """Shows every iteration and every start of a solve, and keeps them.

    On stderr if no console is given; the heading comes first, once nothing was refused.
    """

    def __init__(
        self, quiet: bool = False, console: Console | None = None, heading: tuple[str, ...] = ()
    ) -> None:
        super().__init__()
        self._heading = heading
        self._console = _Lines(quiet, console)
        self._live: Live | None = None
        self._drawn = 0.0
        self._stage = ""
        self._shown = 0

    def __enter__(self) -> Progress:
        """Begin to show."""
        if self._console.live:
            self._live = Live(
                Text("building the problem (Ctrl-C stops)", style="dim"),
                console=self._console.console,
                auto_refresh=False,
                transient=True,
            )
            self._live.start(refresh=True)
        return self

    def __exit__(self, *_: object) -> None:
        """Show how the last stage ended and take the live line away."""
        self._show()
        if self._live is not None:
            self._live.stop()

    def __call__(self, stage: str, report: ProgressReport) -> None:
        """Take note of one iteration."""
        self._begin()
        if stage != self._stage:
            self._show()
            self._stage = stage
        super().__call__(stage, report)
        now = time.perf_counter()
        if self._live is None:
            if report.iteration % EVERY == 0:
                self._show()
        elif now - self._drawn >= PAUSE:
            self._drawn = now
            self._live.update(Text(self.lines[-1], no_wrap=True, overflow="crop"), refresh=True)

    def optimum(self, end: LocalOptimum) -> None:
        """Take note of where one of several starts ended."""
        self._begin()
        self._show()
        super().optimum(end)
        self._show()

    def _begin(self) -> None:
        heading, self._heading = self._heading, ()
        for line in heading:
            self._console.print(line, style="")

    def _show(self) -> None:
        """Show the last line unless it was shown."""
        if self._shown < len(self.lines):
            self._shown = len(self.lines)
            self._console.print(self.lines[-1])


class BatchProgress(Watch):
    """Shows how a study of many cases goes on, on stderr if no console is given."""

    def __init__(self, quiet: bool = False, console: Console | None = None) -> None:
        self._lines = _Lines(quiet, console)
        self._bar: Bar | None = None
        self._row = TaskID(0)
        self._total = self._ended = self._failed = 0
        self._workers: int | None = None

    def __enter__(self) -> BatchProgress:
        """Begin to show."""
        return self

    def __exit__(self, *_: object) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def begin(self, total: int, kept: int, workers: int | None) -> None:
        """Show how much there is to do."""
        self._total, self._ended, self._workers = total, kept, workers
        if self._lines.live:
            self._bar = Bar(
                TextColumn("cases"),
                BarColumn(),
                TextColumn("{task.completed} of {task.total}"),
                TextColumn("{task.fields[state]}"),
                TimeRemainingColumn(),
                console=self._lines.console,
                transient=True,
            )
            self._row = self._bar.add_task("", total=total, completed=kept, state=self._state())
            self._bar.start()
        elif kept:
            self._lines.print(f"{kept} of {total} cases were there")

    def ended(self, case: Ended) -> None:
        """Show how a case ended."""
        self._ended += 1
        self._failed += not case.converged
        if self._bar is None or not case.converged:
            count = f"[{self._ended}/{self._total}]"
            self._lines.print(f"{count} {case.case.name}: {case.status}, {case.seconds:.1f} s")
        if self._bar is not None:
            self._bar.update(self._row, completed=self._ended, state=self._state())

    def _state(self) -> str:
        parts = [f"{self._failed} failed"] * bool(self._failed)
        if self._workers is not None:
            parts.append(f"{min(self._workers, self._total - self._ended)} running")
        return ", ".join(parts)
