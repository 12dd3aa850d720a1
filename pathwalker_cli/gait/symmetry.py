"""A symmetric gait from one of its steps: the other step is the mirror image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import GENERATORS, mirror_permutation, mirrored
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.problem import algebraic_names
from pathwalker_cli.model.contact import mirrored_phase
from pathwalker_cli.model.parts import Parts
from pathwalker_cli.model.skeleton import Side
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion


def asymmetries(walker: Walker) -> list[str]:
    """Return in words what differs between the sides of a walker."""
    model, strengths = walker.model, walker.max_isometric_torque
    order, zero = mirror_permutation(walker.skeleton.coordinates), np.zeros(walker.skeleton.size)
    right, left = np.split(walker.foot_points(zero), 2)
    shapes = {n.place: walker.values[n.address] for n in walker.parts.shapes}
    round_alike = all(shapes[n.place] == walker.values[n.address] for n in walker.parts.shapes)
    q = np.linspace(-0.3, 0.6, zero.size)
    bias, swapped = (pin.nonLinearEffects(model, model.createData(), k, k) for k in (q, q[order]))
    alike = {
        "strengths": np.allclose(strengths, strengths[mirror_permutation(GENERATORS)]),
        "contact points": np.allclose(right, left) and round_alike,
        "contacts": len(set(walker.parts.contact)) == 1,
        "masses or lengths": np.allclose(bias, swapped[order], rtol=1e-9, atol=1e-9),
        "orthoses": _worn(walker, "right") == _worn(walker, "left"),
    }
    return [name for name, same in alike.items() if not same]


def _worn(walker: Walker, side: Side) -> dict[str, float]:
    """Return the numbers of the orthosis of a side by name, springs left out."""
    device = walker.device
    parts = [part[side] for part in (device.elements, device.cuffs) if side in part]
    numbers = (n for part in parts for n in part.numbers if n.name not in device.identified)
    return {number.name: walker.values[number.address] for number in numbers}


def require_symmetry(walker: Walker) -> None:
    """Refuse half a cycle of a walker whose sides differ, or of which one alone is to be chosen.

    Raises:
        ConfigError: If so.
    """
    names = {unknown.name for unknown in walker.unknowns}
    alone = [unknown for unknown in walker.unknowns if mirrored(unknown.name) not in names]
    if alone:
        raise ConfigError(
            f"frees one side alone, but half a cycle makes both sides alike ({alone[0].name})",
            where=f"free.{alone[0].address}",
            mend=f"free {alone[0].numbers[0].place} for both sides, or set half_cycle to false",
        )
    differing = asymmetries(walker)
    if differing:
        raise ConfigError(
            f"asks for half a cycle, but {', '.join(differing)} differ between the sides of "
            f"{walker.patient.id}",
            where="half_cycle",
            mend="set half_cycle to false",
        )


def full_stride(parts: Parts, step: PhasedMotion) -> PhasedMotion:
    """Return a step, which ends in its own mirrored beginning, followed by its mirror image."""
    length = walked_distance(step)
    costs = step.phases[-1].integrals[-1] - step.phases[0].integrals[0]
    second = tuple(_mirrored(parts, phase, length, costs) for phase in step.phases)
    return PhasedMotion(step.phases + second, step.parameters)


def _mirrored(parts: Parts, phase: PhaseMotion, length: float, costs: np.ndarray) -> PhaseMotion:
    """Return a phase with left and right exchanged, one step on."""
    skeleton, pattern = parts.skeleton, parts.pattern
    here, there = (pattern.phase(p) for p in (phase.name, mirrored_phase(phase.name).name))
    names, wanted = (algebraic_names(skeleton, contact) for contact in (here, there))
    muscles = mirror_permutation(GENERATORS)
    order = mirror_permutation(skeleton.coordinates + skeleton.named("velocity"))
    states, inner = phase.states[:, order], phase.inner_states[..., order]
    for values in (states, inner):
        values[..., skeleton.index("pelvis_tx")] += length
    return replace(
        phase,
        name=there.name,
        states=states,
        smooth=phase.smooth[:, muscles],
        controls=phase.controls[:, muscles],
        integrals=phase.integrals + costs,
        inner_states=inner,
        algebraic=phase.algebraic[..., [names.index(mirrored(name)) for name in wanted]],
    )
