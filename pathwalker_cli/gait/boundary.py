"""What ties the ends of a gait together, and what is minimised: equations (8), (9) and (10)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from pathwalker_cli.conventions import mirror_permutation
from pathwalker_cli.gait.costs import Costs, Totals
from pathwalker_cli.model.contact import ContactPhase
from pathwalker_cli.ocp.problem import INFINITY, Boundary, Instant, Rows, Variables

Groups = tuple[Variables, Variables, Variables]


def gait_boundary(
    groups: Groups,
    parameters: Variables,
    costs: Costs,
    weights: Mapping[str, ca.SX],
    phases: Sequence[ContactPhase],
    mirrored: bool,
    start: Rows | None = None,
) -> Boundary:
    """Return boundary rows and objective of a gait.

    Args:
        groups: States, activations and their rates.
        parameters: Free parameters; of a mirrored gait left and right are equal.
        costs: The cost terms.
        weights: Weight of every one by name.
        phases: The phases.
        mirrored: Whether the phases are one step and the other is its mirror image.
        start: Rows in the first instant's states (the symbol of `groups[0]`) of a passage that
            is not periodic; None for a periodic gait.
    """
    first, last = _instant(groups, "first"), _instant(groups, "last")
    durations = ca.SX.sym("durations", len(phases))
    totals = ca.SX.sym("integrals", len(costs.integrals))
    steps = 2 if mirrored else 1  # distance, time and costs are those of a whole stride
    x = groups[0].names.index("pelvis_tx")
    distance = steps * (last[0][x] - first[0][x])
    time = steps * ca.sum1(durations)
    speed, names = ca.vertcat(distance, distance / time), ("distance", "walking_speed")
    free = Rows.make(speed, names, 1.0, -INFINITY, INFINITY)
    if start is None:
        ends = _periodicity(groups, first, last, mirrored)
    else:
        (value,) = ca.substitute([start.value], [groups[0].symbol], [first[0]])
        ends = [replace(start, value=value)]
    rows = Rows.join(*ends, *([_symmetry(parameters)] if mirrored else []), free)
    total = dict(zip(costs.integrals, ca.vertsplit(steps * totals), strict=True))
    totals_by_name = Totals(total, distance, time, ca.vertsplit(durations), phases)
    objective = costs.objective(weights, totals_by_name)
    return Boundary(first, last, durations, totals, rows, objective)


def _instant(groups: Groups, label: str) -> Instant:
    """Return fresh symbols for x, y and u at one instant."""
    x, y, u = (ca.SX.sym(f"{label}{i}", group.size) for i, group in enumerate(groups))
    return x, y, u


def _symmetry(parameters: Variables) -> Rows:
    """Return the rows that let left and right parameters be equal."""
    order = mirror_permutation(parameters.names)
    pairs = [(i, int(k)) for i, k in enumerate(order) if i < k]
    p, names = parameters.symbol, parameters.names
    difference = ca.vertcat(*(p[i] - p[k] for i, k in pairs))
    scale = np.array([parameters.scale[i] for i, _ in pairs])
    return Rows.make(difference, tuple(f"{names[i]} symmetry" for i, _ in pairs), scale)


def _periodicity(groups: Groups, first: Instant, last: Instant, mirrored: bool) -> list[Rows]:
    """Return the rows that let the last instant be the first one, left and right exchanged."""
    result = []
    for a, b, group in zip(first, last, groups, strict=True):
        order = mirror_permutation(group.names) if mirrored else np.arange(group.size)
        kept = [i for i, name in enumerate(group.names) if name != "pelvis_tx"]
        names = tuple(f"{group.names[i]} periodicity" for i in kept)
        result.append(Rows.make((b - a[order.tolist()])[kept], names, group.scale[kept]))
    return result
