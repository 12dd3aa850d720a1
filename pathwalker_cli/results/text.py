"""The short summary of a run on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pathwalker_cli.conventions import SIDES

__all__ = ["ActiveBound", "active_bounds", "summary", "summary_renderable", "summary_rows"]

_ACTIVE: Final = 1e-3
"""Share of its range within which a value counts as sitting at a limit: interior-point solvers
stay a little away from every bound, by far less than this."""

_SYMBOLS: Final = {"dorsiflexion_stiffness": "K_D", "plantarflexion_stiffness": "K_P"}

_WISH: Final = {"upper": "stiffer", "lower": "softer"}


@dataclass(frozen=True)
class ActiveBound:
    """A free parameter that ended at the edge of its range.

    Args:
        name: What it is, in words, e.g. "K_D right".
        end: "lower" or "upper".
        limit: The limit.
        unit: Its unit.
    """

    name: str
    end: Literal["lower", "upper"]
    limit: float
    unit: str

    def __str__(self) -> str:
        """Say what it means for the result."""
        return (
            f"{self.name} sits at its {self.end} limit of {self.limit:.4g} {self.unit}: "
            f"a {_WISH[self.end]} one would cost less"
        )


def active_bounds(
    metrics: Mapping[str, Any], ranges: Mapping[str, tuple[float, float]]
) -> tuple[ActiveBound, ...]:
    """Return the orthosis stiffnesses that sit at an edge of their range.

    Args:
        metrics: `GaitMetrics.as_dict()`.
        ranges: Per "dorsiflexion_stiffness" and "plantarflexion_stiffness", or per side, e.g.
            "dorsiflexion_stiffness_left", lowest and highest allowed value [N m/rad].
    """
    found = []
    for stem, symbol in _SYMBOLS.items():
        for side in SIDES:
            key = f"{stem}_{side}"
            value, limits = metrics.get(key), ranges.get(key, ranges.get(stem))
            if value is None or limits is None:
                continue
            low, high = limits
            if low == high:
                continue  # prescribed, not found
            margin, name = _ACTIVE * (high - low), f"{symbol} {side}"
            if value >= high - margin:
                found.append(ActiveBound(name, "upper", high, "N m/rad"))
            elif value <= low + margin:
                found.append(ActiveBound(name, "lower", low, "N m/rad"))
    return tuple(found)


def summary_rows(
    metrics: Mapping[str, Any], status: str, cost: float | None = None
) -> list[tuple[str, str]]:
    """Return label and value of every line of the summary.

    Args:
        metrics: `GaitMetrics.as_dict()`.
        status: How the solve ended.
        cost: Value of the objective; left out without one.
    """
    steps = (f"{side} {metrics[f'step_length_{side}']:.3f} m" for side in SIDES)
    knees = (
        f"{side} {np.rad2deg(metrics[f'min_stance_knee_flexion_{side}']):.1f} deg" for side in SIDES
    )
    rows = [("status", status)]
    if cost is not None:
        rows.append(("cost", f"{cost:.5g}"))
    rows += [
        ("walking speed", f"{metrics['walking_speed']:.3f} m/s"),
        ("stride", f"{metrics['distance']:.3f} m in {metrics['stride_time']:.3f} s"),
        ("step length", ", ".join(steps)),
        ("least knee flexion in stance", ", ".join(knees)),
    ]
    for stem, symbol in _SYMBOLS.items():
        for side in SIDES:
            value = metrics.get(f"{stem}_{side}")
            if value is not None:
                text = f"{value:.1f} N m/rad ({np.deg2rad(value):.2f} N m/deg)"
                rows.append((f"{symbol} {side}", text))
    return rows


def summary(
    metrics: Mapping[str, Any],
    status: str,
    cost: float | None = None,
    bounds: Iterable[ActiveBound] = (),
) -> str:
    """Return the summary of a run as plain text.

    Args:
        metrics: `GaitMetrics.as_dict()`.
        status: How the solve ended.
        cost: Value of the objective; left out without one.
        bounds: Active bounds, one line each.
    """
    rows = summary_rows(metrics, status, cost)
    width = max(len(label) for label, _ in rows)
    lines = [f"{label:<{width}}  {value}" for label, value in rows]
    return "\n".join([*lines, *(f"note: {bound}" for bound in bounds)])


def summary_renderable(
    metrics: Mapping[str, Any],
    status: str,
    cost: float | None = None,
    bounds: Iterable[ActiveBound] = (),
) -> RenderableType:
    """Return the same summary for a `rich` console, which drops the colours off a terminal.

    Args:
        metrics: `GaitMetrics.as_dict()`.
        status: How the solve ended.
        cost: Value of the objective; left out without one.
        bounds: Active bounds, one line each.
    """
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    for label, value in summary_rows(metrics, status, cost):
        table.add_row(label, Text(value))
    notes = (Text.assemble(("note: ", "yellow"), str(bound)) for bound in bounds)
    return Group(table, *notes)
