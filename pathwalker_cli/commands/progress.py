"""Live progress of a solve: one moving line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.live import Live
from rich.text import Text

if TYPE_CHECKING:
    from pathwalker_cli.ocp.ipopt import ProgressReport
    from pathwalker_cli.ocp.solution import LocalOptimum

__all__ = ["Progress"]

EVERY: Final = 20
"""Iterations between two plain lines."""
PAUSE: Final = 0.1
"""Least time between two redraws of the live line [s]."""


class Progress:
    """Shows every iteration and keeps all of them as `lines`.

    Args:
        quiet: Whether nothing shall be shown.
        console: Where to show it; stderr if left out.
    """

    def __init__(self, quiet: bool = False, console: Console | None = None) -> None:
        self.lines: list[str] = []
        self._console = console or Console(stderr=True)
        self._quiet = quiet
        self._live: Live | None = None
        self._began = time.perf_counter()
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
        if stage != self._stage:
            self._end_stage()
            self._stage = stage
        now = time.perf_counter() - self._began
        self._last = (
            f"{stage:<10} iteration {report.iteration:4d}   cost {report.objective:<11.5g} "
            f"infeasibility {report.infeasibility:.1e}   {now:6.1f} s"
        )
        self.lines.append(self._last)
        if self._live is not None:
            self._redraw(now)
        elif report.iteration % EVERY == 0:
            self._print()

    def optimum(self, found: LocalOptimum) -> None:
        """Take note of where one of several starts ended."""
        self._end_stage()
        self._last = (
            f"start {found.start:<3d} {found.status}, cost {found.cost:.5g}, "
            f"{found.walking_speed:.3f} m/s, {found.iterations} iterations, {found.description}"
        )
        self.lines.append(self._last)
        self._print()

    def _redraw(self, now: float) -> None:
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
