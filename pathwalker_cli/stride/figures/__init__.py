"""Figures of a stride, all in one look."""

from __future__ import annotations

from pathwalker_cli.stride.figures.activations import activations
from pathwalker_cli.stride.figures.ankle import ankle_torque, orthosis_curves
from pathwalker_cli.stride.figures.curves import Band, Reference
from pathwalker_cli.stride.figures.ground_forces import ground_forces
from pathwalker_cli.stride.figures.joint_angles import joint_angles
from pathwalker_cli.stride.figures.joint_moments import joint_moments
from pathwalker_cli.stride.figures.save import FIGURES, figure_names, make_figure, save_figures
from pathwalker_cli.stride.figures.stick_figures import stick_figures

__all__ = [
    "FIGURES",
    "Band",
    "Reference",
    "activations",
    "ankle_torque",
    "figure_names",
    "ground_forces",
    "joint_angles",
    "joint_moments",
    "make_figure",
    "orthosis_curves",
    "save_figures",
    "stick_figures",
]
