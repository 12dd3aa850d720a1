"""Random patients and motions, and what mirroring and scaling make of them."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np
from hypothesis import strategies as st

from helpers import walker_of
from pathwalker_cli.config import BoundsConfig
from pathwalker_cli.conventions import (
    COORDINATES,
    GENERATORS,
    SIDES,
    STIFFNESSES,
    mirror_permutation,
    mirrored,
)
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.costs import Costs
from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.skeleton import PLANAR_WALKER
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.ocp.problem import ProblemNumbers
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import SegmentLengths
from pathwalker_cli.starter.child import Child, made_child

MIDLINE: Final = ("pelvis", "hip_drop", "lumbar_height", "trunk", "head")
LIMBS: Final = tuple(name for name in SegmentLengths.model_fields if name not in MIDLINE)
STRENGTHS: Final = tuple(
    f"{joint}_{action}" for joint in ("hip", "knee", "ankle") for action in ("extension", "flexion")
)
GOALS: Final = Costs(("crouch", "centre_of_pressure", "peak_activation"))
"""Goals that treat both steps alike."""
WEIGHTS: Final = {
    "effort": 1.0,
    "rate": 1e-3,
    "acceleration": 0.1,
    **dict.fromkeys(GOALS.names, 1.0),
}
DEGREE, INTERVALS, FRICTION = 3, 2, 0.7


def _between(lower: float, upper: float) -> st.SearchStrategy[float]:
    return st.floats(lower, upper).map(lambda x: float(f"{x:.6g}"))


def _pairs(lower: float, upper: float, equal: bool) -> st.SearchStrategy[dict[str, float]]:
    """Return numbers right and left."""
    one = _between(lower, upper)
    if equal:
        return one.map(lambda x: dict.fromkeys(SIDES, x))
    return st.fixed_dictionaries(dict.fromkeys(SIDES, one))


def _scaled(pair: dict[str, float], factor: float) -> dict[str, float]:
    return {side: share * factor for side, share in pair.items()}


@st.composite
def orthoses(draw: st.DrawFn, equal: bool = False) -> dict[str, Any]:
    """Return the content of an orthosis file; some of these are refused."""
    springs = st.lists(_between(1.0, 300.0), min_size=2, max_size=2, unique=True).map(sorted)
    ranges = {kind: draw(springs) for kind in ("dorsiflexion", "plantarflexion")}
    return {
        "mass": {part: draw(_between(0.0, 2.0)) for part in ("shank", "foot")},
        "neutral_angle": draw(_between(-0.05, 0.05) | _between(-0.2, 0.2)),
        "free_play": draw(_between(1e-4, 0.05) | _between(1e-4, 0.2)),
        "preload_torque": draw(st.just(0.0) | _between(0.0, 20.0)),
        "dorsiflexion_stop": draw(_pairs(-0.7, -0.1, equal) | _pairs(-0.7, -0.001, equal)),
        "plantarflexion_stop": draw(_pairs(0.1, 0.7, equal) | _pairs(0.001, 0.7, equal)),
        "stop_stiffness": {kind: draw(_between(1.0, 1000.0)) for kind in ranges},
        "stiffness_guess": {kind: pair[0] for kind, pair in ranges.items()},
        "stiffness_range": {**ranges, "source": "made up"},
    }


USUAL: Final[dict[str, Any]] = {
    "mass": {"shank": 0.35, "foot": 0.65},
    "neutral_angle": -0.02,
    "free_play": 0.01,
    "preload_torque": 1.0,
    "dorsiflexion_stop": {"right": -0.13, "left": -0.12},
    "plantarflexion_stop": {"right": 0.10, "left": 0.09},
    "stop_stiffness": {"dorsiflexion": 200.0, "plantarflexion": 180.0},
    "stiffness_guess": {"dorsiflexion": 55.0, "plantarflexion": 5.0},
    "stiffness_range": {
        "dorsiflexion": [5.0, 92.0],
        "plantarflexion": [5.0, 92.0],
        "source": "made up",
    },
}
"""An orthosis with different stops."""


@st.composite
def patients(draw: st.DrawFn, equal: bool = False) -> Patient:
    """Return a patient with an orthosis; lengths, soles and strengths differ between the sides.

    Args:
        draw: Draws.
        equal: Whether the sides are equal instead.
    """
    child: Child = made_child(
        "made",
        age=draw(_between(4.0, 15.0)),
        mass=draw(_between(10.0, 90.0)),
        height=draw(_between(0.9, 1.9)),
    )
    lengths = {name: child.length(name) * draw(_between(0.8, 1.2)) for name in MIDLINE}
    limbs = {name: _scaled(draw(_pairs(0.8, 1.2, equal)), child.length(name)) for name in LIMBS}
    stops = ("dorsiflexion_stop", "plantarflexion_stop")
    worn = {**USUAL, **{name: dict.fromkeys(SIDES, USUAL[name]["left"]) for name in stops if equal}}
    content = {
        "id": child.id,
        "sex": "male",
        "age": child.age,
        "body_mass": child.body_mass,
        "height": child.height,
        "segment_lengths": {**lengths, **limbs},
        "contact_points": {name: draw(_soles(equal)) for name in ("barefoot", "orthosis")},
        "strengths": {
            **{
                name: _scaled(draw(_pairs(0.1, 1.5, equal)), child.strength(name)[0])
                for name in STRENGTHS
            },
            **{
                name: child.strength(name)[0] * draw(_between(0.1, 1.5))
                for name in ("lumbar_extension", "lumbar_flexion")
            },
        },
        "orthosis": worn,
    }
    return Patient.model_validate(content)


@st.composite
def _soles(draw: st.DrawFn, equal: bool) -> dict[str, Any]:
    names = (("heel", -0.09, -0.02), ("toe", 0.05, 0.16))
    ahead = {name: draw(_pairs(low, high, equal)) for name, low, high in names}
    above = {name: draw(_pairs(-0.15, -0.02, equal)) for name in ahead}
    return {side: {n: [ahead[n][side], above[n][side]] for n in ahead} for side in SIDES}


def mirror_image(patient: Patient) -> Patient:
    """Return the patient whose right side is the left one of this one."""
    return Patient.model_validate(_swapped(patient.model_dump(mode="json", exclude_none=True)))


def _swapped(content: Any) -> Any:
    if not isinstance(content, dict):
        return content
    if set(content) == set(SIDES):
        return {"right": content["left"], "left": content["right"]}
    return {
        mirrored(key) if key in COORDINATES else key: _swapped(value)
        for key, value in content.items()
    }


def similar(patient: Patient, length: float, mass: float) -> Patient:
    """Return the patient with all lengths and all masses times a factor, strengths in step.

    Gravity stays: forces grow with the mass, torques with mass times length.
    """
    content = patient.model_dump(mode="json", exclude_none=True)
    content["body_mass"] *= mass
    for place in ("segment_lengths", "contact_points"):
        content[place] = _times(content[place], length)
    content["strengths"] = _times(content["strengths"], mass * length)
    worn = content["orthosis"]
    worn["mass"] = _times(worn["mass"], mass)
    for name in ("preload_torque", "stop_stiffness", "stiffness_guess"):
        worn[name] = _times(worn[name], mass * length)
    for kind in ("dorsiflexion", "plantarflexion"):
        worn["stiffness_range"][kind] = _times(worn["stiffness_range"][kind], mass * length)
    return Patient.model_validate(content)


def _times(content: Any, factor: float) -> Any:
    if isinstance(content, dict):
        return {key: _times(value, factor) for key, value in content.items()}
    if isinstance(content, list):
        return [_times(value, factor) for value in content]
    return content * factor


@cache
def program() -> CollocationProgram:
    """Return the program of a stride with orthoses on a coarse mesh; the reference is zero."""
    walker = walker_of("orthosis")
    gait = GaitProblem(walker, "stride", GOALS)
    numbers = ProblemNumbers(
        gait.shared_values(WEIGHTS, FRICTION),
        gait_bounds(walker, BoundsConfig()).table,
        lambda i, at: np.zeros(len(COORDINATES)),
        (),
    )
    blocks = CollocationBlocks(gait.build(), DEGREE)
    return CollocationProgram(blocks, numbers, meshing.uniform([INTERVALS] * len(PHASES)))


def rows_of(walker: Walker, motion: PhasedMotion) -> tuple[float, dict[tuple[str, str], float]]:
    """Return cost and rows of the program of a walker with orthoses: value by name and place."""
    made = program()
    shared = GaitProblem(walker, "stride", GOALS).shared_values(WEIGHTS, FRICTION)
    numbers = np.concatenate([shared, made.parameters[len(shared) :]])
    cost, values = made.functions["nlp"](made.to_unknowns(motion), numbers)
    places = [made.row_place(row) for row in range(made.rows)]
    found = dict(zip(places, np.asarray(values).ravel().tolist(), strict=True))
    assert len(found) == len(places), "two rows have the same name"
    return float(cost), found


def random_step(seed: int) -> PhasedMotion:
    """Return four phases of anything, but that they end in their own mirrored beginning."""
    rng = np.random.default_rng(seed)
    half, count = len(PHASES) // 2, len(PHASES) // 2 * INTERVALS
    n, m = len(COORDINATES), len(GENERATORS)
    states = rng.normal(size=(count + 1, 2 * n)) * np.repeat([0.4, 2.0], n)
    states[-1] = states[0][mirror_permutation(COORDINATES + PLANAR_WALKER.named("velocity"))]
    states[-1, 0] += 0.3 + rng.random()
    smooth, controls = rng.random((count + 1, m)), 5.0 * rng.normal(size=(count + 1, m))
    for values in (smooth, controls):
        values[-1] = values[0][mirror_permutation(GENERATORS)]
    costs = GOALS.integrals
    integrals = np.cumsum(rng.random((count + 1, len(costs))), axis=0)
    phases = []
    for i, phase in enumerate(PHASES[:half]):
        nodes = slice(i * INTERVALS, (i + 1) * INTERVALS + 1)
        inner = 0.5 * rng.normal(size=(INTERVALS, DEGREE, 2 * n))
        inner[:, -1] = states[nodes][1:]  # the last point is the next node
        phases.append(
            PhaseMotion(
                name=phase.name,
                duration=0.02 + rng.random(),
                mesh=np.linspace(0.0, 1.0, INTERVALS + 1),
                states=states[nodes],
                smooth=smooth[nodes],
                controls=controls[nodes],
                integrals=integrals[nodes],
                inner_states=inner,
                algebraic=20.0 * rng.normal(size=(INTERVALS, DEGREE, 2 * n + len(phase.forces))),
            )
        )
    return PhasedMotion(tuple(phases), rng.uniform(5.0, 92.0, len(STIFFNESSES)))
