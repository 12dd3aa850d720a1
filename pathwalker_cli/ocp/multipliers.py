"""Carry multipliers from one mesh to another, so that a refined problem starts warm.

A multiplier belongs to an instant and grows with the quadrature weight of its row; divided by that
weight it samples a continuous function of time, which is interpolated on the new mesh.
"""

from __future__ import annotations

import numpy as np

from pathwalker_cli.nlp.result import Multipliers
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.phased import collocation_points, quadrature_weights


def transferred(
    old: CollocationProgram, multipliers: Multipliers, new: CollocationProgram
) -> Multipliers:
    """Return multipliers on the mesh of another program of the same problem and degree."""
    return Multipliers(
        _of_unknowns(old, multipliers.unknowns, new), _of_rows(old, multipliers.rows, new)
    )


def _of_rows(old: CollocationProgram, values: np.ndarray, new: CollocationProgram) -> np.ndarray:
    """Return multipliers of the rows, block by block."""
    parts, offset = [], 0
    for before, after in zip(old.occurrences, new.occurrences, strict=True):
        rows = before.block.rows
        times, weights = (np.broadcast_to(k, (rows, before.count))
                          for k in (before.times, before.weights))  # fmt: skip
        new_times, new_weights = (np.broadcast_to(k, (rows, after.count))
                                  for k in (after.times, after.weights))  # fmt: skip
        block = values[offset : offset + times.size].reshape(times.shape, order="F")
        offset += times.size
        result = np.zeros(new_times.shape)
        series = np.array(before.series or range(rows))
        for one in set(series.tolist()):
            at = series == one
            result[at] = _resample(
                times[at], block[at], weights[at], new_times[at], new_weights[at]
            )
        parts.append(result.ravel(order="F"))
    return np.concatenate(parts)


def _resample(
    times: np.ndarray,
    values: np.ndarray,
    weights: np.ndarray,
    new_times: np.ndarray,
    new_weights: np.ndarray,
) -> np.ndarray:
    """Return weighted samples of the function that other weighted samples stand for."""
    order = np.argsort(times, axis=None)
    density = (values / weights).ravel()[order]
    return np.asarray(np.interp(new_times, times.ravel()[order], density) * new_weights)


def _of_unknowns(
    old: CollocationProgram, values: np.ndarray, new: CollocationProgram
) -> np.ndarray:
    """Return multipliers of the bounds on the unknowns, phase by phase."""
    before, after = old.layout, new.layout
    result = np.zeros(after.size)
    result[after.durations] = values[before.durations]
    result[after.parameters] = values[before.parameters]
    for i, (p, q) in enumerate(zip(before.phases, after.phases, strict=True)):
        old_nodes, old_points = _weights(old.meshes[i], old.blocks.degree)
        new_nodes, new_points = _weights(new.meshes[i], new.blocks.degree)
        for name in ("smooth", "controls"):
            a, b = getattr(before, name)[p.nodes], getattr(after, name)[q.nodes]
            for column in range(a.shape[1]):
                result[b[:, column]] = _resample(
                    *(old_nodes[0], values[a[:, column]], old_nodes[1]), *new_nodes
                )
        for name in ("inner_states", "algebraic"):
            a, b = getattr(p, name), getattr(q, name)
            for column in range(a.shape[2]):
                result[b[:, :, column]] = _resample(
                    *(old_points[0], values[a[:, :, column]], old_points[1]), *new_points
                )
    return result


def _weights(
    mesh: np.ndarray, degree: int
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return (times, weights) of the nodes and of the collocation points of a phase."""
    steps = np.diff(mesh)
    around = np.concatenate([[steps[0]], (steps[:-1] + steps[1:]), [steps[-1]]]) / 2
    _, weights = quadrature_weights(degree)
    return (mesh, around), (collocation_points(mesh, degree), steps[:, None] * weights)
