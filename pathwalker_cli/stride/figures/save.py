"""All figures of a stride, as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.io.atomic import atomic_path
from pathwalker_cli.stride.figures.ankle import ankle_torque, orthosis_curves
from pathwalker_cli.stride.figures.curves import Reference
from pathwalker_cli.stride.figures.cycles import (
    activations,
    cuffs,
    ground_forces,
    joint_angles,
    joint_moments,
    toe_joints,
)
from pathwalker_cli.stride.figures.stick_figures import stick_figures
from pathwalker_cli.stride.figures.style import STYLE
from pathwalker_cli.stride.series import GaitSeries

FORMATS: Final = ("png", "svg")
"""What every figure is saved as."""

DPI: Final = 200
"""Dots per inch of the PNG files."""

FIGURES: Final[dict[str, Callable[[GaitSeries, Reference | None], Figure]]] = {
    "stick_figures": stick_figures,
    "joint_angles": joint_angles,
    "joint_moments": joint_moments,
    "ground_forces": ground_forces,
    "activations": activations,
    "ankle_torque": ankle_torque,
    "orthosis_curves": orthosis_curves,
    "toe_joints": toe_joints,
    "cuffs": cuffs,
}
"""Names of the figures and what makes them."""

# Neither a date nor a version: the same stride gives the same bytes.
_METADATA: Final[dict[str, dict[str, str | None]]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
}


def figure_names(series: GaitSeries) -> tuple[str, ...]:
    """Return the figures that make sense for a stride: no orthosis curve when barefoot."""
    walker = series.walker
    special = {"orthosis_curves": walker.device.worn, "toe_joints": walker.parts.toes}
    special["cuffs"] = bool(walker.shelled)
    return tuple(name for name in FIGURES if special.get(name, True))


def make_figure(name: str, series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return a figure in the common style."""
    with mpl.rc_context(STYLE):
        return FIGURES[name](series, reference)


def save_figures(
    series: GaitSeries,
    folder: str | Path,
    reference: Reference | None = None,
    formats: Sequence[str] = FORMATS,
) -> tuple[str, ...]:
    """Save every figure of a stride over recorded bands; return the file names."""
    return tuple(
        file
        for name in figure_names(series)
        for file in save_formats(make_figure(name, series, reference), folder, name, formats)
    )


def save_formats(
    figure: Figure, folder: str | Path, name: str, formats: Sequence[str] = FORMATS
) -> tuple[str, ...]:
    """Save a figure made under `style.STYLE` as PNG, SVG or both; return the file names."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    files = tuple(f"{name}.{extension}" for extension in formats)
    for file in files:
        save_figure(figure, Path(folder) / file)
    return files


def save_figure(figure: Figure, path: str | Path) -> None:
    """Save a figure in one stroke; its layout is settled by the first format."""
    path = Path(path)
    extension = path.suffix.removeprefix(".")
    with mpl.rc_context(STYLE), atomic_path(path) as temporary:
        figure.savefig(temporary, format=extension, dpi=DPI, metadata=_METADATA[extension])
    figure.set_layout_engine(None)  # "none" would have every further format drawn twice
