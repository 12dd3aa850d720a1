"""Blocks of gait problems, built once per structure and process.

Everything that a patient or a config brings in is a number of the problem; problems of equal
structure therefore share their blocks and all derivatives.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Final

from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.gait import GaitProblem

__all__ = ["gait_blocks"]

_BUILT: Final[dict[Hashable, CollocationBlocks]] = {}


def gait_blocks(gait: GaitProblem, degree: int) -> CollocationBlocks:
    """Return the collocation blocks of a gait problem.

    Args:
        gait: The problem.
        degree: Number of Radau points in an interval.
    """
    key = (gait.structure, degree)
    if key not in _BUILT:
        _BUILT[key] = CollocationBlocks(gait.build(), degree)
    return _BUILT[key]
