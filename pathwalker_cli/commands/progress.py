"""Live progress of a solve: one moving line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.live import Live
from rich.text import Text

from pathwalker_cli.studies.run import RunLog

if TYPE_CHECKING:
    from pathwalker_cli.gait.solution import LocalOptimum
    from pathwalker_cli.nlp.watch import ProgressReport

__all__ = ["Progress"]

EVERY: Final = 20
"""Iterations between two plain lines."""
PAUSE: Final = 0.1
"""Least time between two redraws of the live line [s]."""


class Progress(RunLog):
    """Shows every iteration and every start, and keeps them.

    Args:
        quiet: Whether nothing shall be shown.
        console: Where to show it; stderr if left out.
        heading: Lines to show before the first iteration, once nothing was refused.
    """

    def __init__(
        self, quiet: bool = False, console: Console | None = None, heading: tuple[str, ...] = ()
    ) -> None:
        super().__init__()
        self._heading = heading
        self._console = console or Console(stderr=True)
        self._quiet = quiet
        self._live: Live | None = None
        self._drawn = 0.0
        self._stage = ""
        self._last = ""
        self._shown = ""

    def __enter__(self) -> Progress:
        """Begin to show."""
        if self._console.is_terminal and not self._quiet:
            self._live = Live(
                Text("building the problem (Ctrl-C stops)", style="dim"),
                console=self._console,
                auto_refresh=False,
                transient=True,
            )
            self._live.start(refresh=True)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Show how the last stage ended and take the live line away."""
        self._end_stage()
        if self._live is not None:
            self._live.stop()

    def __call__(self, stage: str, report: ProgressReport) -> None:
        """Take note of one iteration."""
        self._begin()
        if stage != self._stage:
            self._end_stage()
            self._stage = stage
        super().__call__(stage, report)
        self._last = self.lines[-1]
        if self._live is not None:
            self._redraw()
        elif report.iteration % EVERY == 0:
            self._print()

    def optimum(self, found: LocalOptimum) -> None:
        """Take note of where one of several starts ended."""
        self._begin()
        self._end_stage()
        super().optimum(found)
        self._last = self.lines[-1]
        self._print()

    def _begin(self) -> None:
        heading, self._heading = self._heading, ()
        for line in heading if not self._quiet else ():
            self._console.print(Text(line), soft_wrap=True)

    def _redraw(self) -> None:
        now = time.perf_counter()
        if self._live is not None and now - self._drawn >= PAUSE:
            self._drawn = now
            self._live.update(Text(self._last, no_wrap=True, overflow="crop"), refresh=True)

    def _end_stage(self) -> None:
        if self._last != self._shown:
            self._print()

    def _print(self) -> None:
        self._shown = self._last
        if not self._quiet:
            self._console.print(Text(self._last, style="dim"), soft_wrap=True)
