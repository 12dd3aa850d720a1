"""The gait of a child's mirror image is the mirror image of the child's gait."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from made_patients import mirror_image
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.conventions import STIFFNESSES, mirror_permutation, mirrored
from pathwalker_cli.gait.problem import ACTIVATIONS, RATES, algebraic_names
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.skeleton import PLANAR_WALKER
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.patient import Patient, load_patient

HALF = len(PHASES) // 2


def image_of(stride: PhasedMotion) -> PhasedMotion:
    """Return a stride with left and right exchanged, which begins with its second step."""
    first, second = stride.phases[:HALF], stride.phases[HALF:]
    middle, end = second[0], second[-1]
    forward = float(end.states[-1, 0] - middle.states[0, 0])
    costs = end.integrals[-1] - middle.integrals[0]
    phases = [
        *(turned(p, i + HALF, -middle.states[0, 0], -middle.integrals[0])
          for i, p in enumerate(second)),
        *(turned(p, i, forward, costs) for i, p in enumerate(first)),
    ]  # fmt: skip
    return PhasedMotion(
        tuple(phases), stride.parameters[mirror_permutation(STIFFNESSES)[: len(stride.parameters)]]
    )


def turned(phase: PhaseMotion, i: int, shift: float, costs: np.ndarray) -> PhaseMotion:
    """Return phase i with left and right exchanged, elsewhere."""
    here, there = PHASES[i], PHASES[(i + HALF) % len(PHASES)]
    names, others = (algebraic_names(PLANAR_WALKER, contact) for contact in (here, there))
    order = [names.index(mirrored(name)) for name in others]
    of_states = mirror_permutation(PLANAR_WALKER.coordinates + PLANAR_WALKER.named("velocity"))
    states, inner = phase.states[:, of_states], phase.inner_states[..., of_states]
    states[:, 0] += shift
    inner[..., 0] += shift
    return replace(
        phase,
        name=there.name,
        states=states,
        inner_states=inner,
        smooth=phase.smooth[:, mirror_permutation(ACTIVATIONS)],
        controls=phase.controls[:, mirror_permutation(RATES)],
        integrals=phase.integrals + costs,
        algebraic=phase.algebraic[..., order],
    )


def case_of(patient: Patient) -> Case:
    """Return a quick barefoot prediction of a patient."""
    config = smoke_version(load_config("mapd-barefoot"))
    return Case(with_values(config, {"solver.tolerance": 1e-6}), patient)


def cost_of(solver: GaitSolver, motion: PhasedMotion) -> float:
    """Return the cost of a motion."""
    program = CollocationProgram(solver.blocks, solver.prediction, motion.meshes)
    return float(program.functions["nlp"](program.to_unknowns(motion), program.parameters)[0])


def test_the_solution_of_the_mirror_image_is_mirrored() -> None:
    """The shipped patient is not symmetric; a mirrored optimum is one, at the same cost."""
    child = load_patient("sreenivasa2017-patient")
    solver = GaitSolver(case_of(child))
    found = solver.solve()
    assert found.status == "converged"
    stride = found.last_motion
    image = image_of(stride)
    again = image_of(image)
    for one, two in zip(stride.phases, again.phases, strict=True):
        assert one.states == pytest.approx(two.states, abs=1e-12)
    other = GaitSolver(case_of(mirror_image(child)))
    assert cost_of(other, image) == pytest.approx(cost_of(solver, stride), rel=1e-13)
    solved = other.solve(image)
    assert solved.status == "converged"
    assert solved.cost == pytest.approx(found.cost, rel=1e-4)
    for one, two in zip(solved.last_motion.phases, image.phases, strict=True):
        assert one.duration == pytest.approx(two.duration, abs=0.02)  # a flat valley
    # the sides of this child differ, or the test would show nothing
    sides = [phase.duration for phase in stride.phases]
    assert sides[:HALF] != pytest.approx(sides[HALF:], rel=0.05)
