"""What the mesh does to cost and motion: a Newton step on halved intervals, none is solved.

The optimum on a mesh, carried to one of halved intervals, misses the conditions of optimality:
between its nodes it does not follow the dynamics, and controls could bend where they are straight.
The step that mends this to first order changes the cost by what the finer mesh would, to second
order in what was missed (dual weighted residuals: Becker and Rannacher 2001).

References:
    Becker R, Rannacher R (2001). An optimal control approach to a posteriori error estimation in
    finite element methods. Acta Numerica 10:1-102.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from pathwalker_cli.nlp.kkt import KktSystem
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.ocp.phased import PhasedMotion


@dataclass(frozen=True)
class CostError:
    """Estimated change of the optimal cost if all intervals are halved.

    Args:
        total: The change; negative where a finer mesh costs less.
        shares: What every interval adds to it, one array for each phase, shape (N,).
        motion: The motion on that mesh to first order; the parameters stay.  None where the step
            would leave a phase no time.
    """

    total: float
    shares: tuple[np.ndarray, ...]
    motion: PhasedMotion | None


_TRUSTED: Final = 0.1
"""Largest share of the cost that is taken for a small correction."""


def cost_error(program: CollocationProgram, result: NlpResult) -> CostError | None:
    """Return the estimate for an optimum.

    It comes within a factor of about two of what a solve finds, where a control is singular within
    three (tests).  None where the mesh is too coarse to tell: the step is no small correction.
    """
    meshes = tuple(_halved(mesh) for mesh in program.meshes)
    fine = CollocationProgram(program.blocks, program.numbers, meshes)
    motion = program.to_motion(result.unknowns).resampled(meshes, program.blocks.degree)
    unknowns = fine.to_unknowns(motion)
    _, rows = fine.functions["nlp"](unknowns, fine.parameters)
    point: dict[str, Any] = {"unknowns": unknowns, "rows": np.asarray(rows).ravel()}
    point["multipliers"] = transferred(program, result.multipliers, fine)
    step = KktSystem(fine, replace(result, **point)).step
    shares = np.concatenate([step.by_unknowns, step.by_rows])
    intervals = [len(mesh) - 1 for mesh in program.meshes]
    groups = np.concatenate([keys[:, 0] for keys in fine.elimination_keys])
    # two halves of an interval, each with a group for every point, one for its end and its node
    of = groups // (2 * (program.blocks.degree + 2))
    total = float(shares.sum())
    if not abs(total) <= _TRUSTED * abs(result.objective):
        return None
    gained = np.bincount(of, shares, minlength=sum(intervals))
    # what ties the ends together belongs to no interval
    each = np.split(gained[: sum(intervals)], np.cumsum(intervals)[:-1])
    motion = fine.to_motion(step.unknowns)
    return CostError(total, tuple(each), motion if (motion.durations > 0.0).all() else None)


def _halved(mesh: np.ndarray) -> np.ndarray:
    """Return the nodes with one more in the middle of every interval."""
    return np.sort(np.concatenate([mesh, (mesh[:-1] + mesh[1:]) / 2.0]))
