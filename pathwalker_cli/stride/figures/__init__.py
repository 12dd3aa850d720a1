"""Figures of a stride, all in one look."""

from __future__ import annotations

from pathwalker_cli.stride.figures.ankle import orthosis_curves
from pathwalker_cli.stride.figures.curves import Band, Reference
from pathwalker_cli.stride.figures.save import FIGURES, figure_names, make_figure, save_figures

__all__ = [
    "FIGURES", "Band", "Reference", "figure_names", "make_figure", "orthosis_curves",
    "save_figures",
]  # fmt: skip
