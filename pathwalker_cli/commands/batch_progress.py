"""Live progress of a study of many cases: a bar on a terminal, a line per case elsewhere."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.text import Text

from pathwalker_cli.studies.batch.ledger import Ended
from pathwalker_cli.studies.batch.study import Watch

__all__ = ["BatchProgress"]


class BatchProgress(Watch):
    """Shows how a study goes on.

    Args:
        quiet: Whether nothing shall be shown.
        console: Where to show it; stderr if left out.
    """

    def __init__(self, quiet: bool = False, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._quiet = quiet
        self._bar: Progress | None = None
        self._row = TaskID(0)
        self._total = self._ended = self._failed = 0
        self._workers: int | None = None

    def __enter__(self) -> BatchProgress:
        """Begin to show."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def begin(self, total: int, kept: int, workers: int | None) -> None:
        """Show how much there is to do."""
        self._total, self._ended, self._workers = total, kept, workers
        if self._console.is_terminal and not self._quiet:
            self._bar = _bar(self._console)
            self._row = self._bar.add_task("", total=total, completed=kept, state=self._state())
            self._bar.start()
        elif kept:
            self._say(f"{kept} of {total} cases were there")

    def ended(self, case: Ended) -> None:
        """Show how a case ended."""
        self._ended += 1
        self._failed += not case.converged
        if self._bar is None or not case.converged:
            count = f"[{self._ended}/{self._total}]"
            self._say(f"{count} {case.case.name}: {case.status}, {case.seconds:.1f} s")
        if self._bar is not None:
            self._bar.update(self._row, completed=self._ended, state=self._state())

    def _state(self) -> str:
        """Return how many cases failed and run."""
        parts = [f"{self._failed} failed"] * bool(self._failed)
        if self._workers is not None:
            parts.append(f"{min(self._workers, self._total - self._ended)} running")
        return ", ".join(parts)

    def _say(self, line: str) -> None:
        if not self._quiet:
            self._console.print(Text(line, style="dim"), soft_wrap=True)


def _bar(console: Console) -> Progress:
    """Return a bar with counts and the time that is left."""
    return Progress(
        TextColumn("cases"),
        BarColumn(),
        TextColumn("{task.completed} of {task.total}"),
        TextColumn("{task.fields[state]}"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
