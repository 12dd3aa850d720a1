"""Blocks of gait problems, built once per structure and process.

Everything that a patient or a config brings in is a number of the problem; problems of equal
structure therefore share their blocks and all derivatives.
"""

from __future__ import annotations

from collections.abc import Hashable
from importlib import resources
from pathlib import Path
from typing import Final

import pinocchio as pin

from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape_store import Makers, cache_folder, keep_tapes, kept_tapes
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks

_MAKERS: Final[Makers] = (
    pin.__version__,
    Path(str(resources.files("pathwalker_cli.model.backends") / "libpinocchio_casadi.so")),
)
"""What makes the expressions of a gait beside the sources: Pinocchio, and its compiled back end."""

_BUILT: Final[dict[Hashable, CollocationBlocks]] = {}


def gait_blocks(gait: GaitProblem, degree: int) -> CollocationBlocks:
    """Return the collocation blocks of a gait problem with so many Radau points in an interval."""
    key = (gait.structure, degree)
    if key not in _BUILT:
        kept = None if kernels() is None else kept_tapes(key, _MAKERS)
        _BUILT[key] = CollocationBlocks(gait.build(), degree, kept)
        if kept is None:
            _keep(_BUILT[key], key)
    return _BUILT[key]


def _keep(blocks: CollocationBlocks, key: Hashable) -> None:
    """Keep the tapes of blocks for other processes, if there are tapes and a place for them."""
    if kernels() is None or cache_folder() is None:
        return
    derived = [block for block in blocks.blocks if block.matters]
    tapes = {b.name: (b.rows, b.tapes) for b in derived if b.tapes is not None}
    if len(tapes) == len(derived):
        keep_tapes(key, tapes, _MAKERS)
