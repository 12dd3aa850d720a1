"""Blocks of gait problems, built once per structure and process.

Everything that a patient or a config brings in is a number of the problem; problems of equal
structure therefore share their blocks and all derivatives.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Final

from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.gait import GaitProblem
from pathwalker_cli.ocp.tape_store import keep_tapes, kept_tapes

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
        blocks = CollocationBlocks(gait.build(), degree)
        _give_tapes(blocks, key)
        _BUILT[key] = blocks
    return _BUILT[key]


def _give_tapes(blocks: CollocationBlocks, key: Hashable) -> None:
    """Give blocks the tapes that another process made of equal ones, or keep theirs for others."""
    kept = kept_tapes(key)
    if kept is not None:
        for block, tapes in zip(blocks.blocks, kept, strict=True):
            block.adopt(tapes)
        return
    made = [block.tapes for block in blocks.blocks]
    known = [tapes for tapes in made if tapes is not None]
    if len(known) == len(made):
        keep_tapes(key, known)
