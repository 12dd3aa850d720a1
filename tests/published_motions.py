"""Motions of Sreenivasa et al. (2017): a few instants with their digits, and the full files.

The instants are those that decide step lengths, speed and the least knee flexion of stance: begin
of the stride, least right knee, begin of `left_flat`, least left knee.  The motions are periodic
but for the forward position, which is given for the end.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pathwalker_cli.conventions import CONTACT_FORCES, COORDINATES, SIDES, Condition
from pathwalker_cli.model.contact import contact_pattern
from pathwalker_cli.model.elements.muscle import generators
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.stride import Stride, phase_stances

PUBLISHED = Path(__file__).parents[2] / "shared" / "published"
needs_published = pytest.mark.skipif(
    not PUBLISHED.is_dir(), reason="needs shared/published beside the checkout"
)

INTERVALS = {
    "ls-barefoot": (5, 5, 3, 3, 5, 5, 3, 3),
    "mapd-barefoot": (9, 9, 7, 7, 9, 9, 7, 7),
    "mapd-orthosis": (9,) * 8,
}
ROWS_PER_INTERVAL = 100

DURATIONS = {
    "mapd-barefoot": (0.145126, 0.331527, 0.024936, 0.112828, 0.261403, 0.14669, 0.07895, 0.00153),
    "mapd-orthosis": (0.071262, 0.449985, 0.035271, 0.050988, 0.141074, 0.38454, 0.03694, 0.03188),
}
DISTANCE = {"mapd-barefoot": 0.672549, "mapd-orthosis": 0.742023}
INSTANTS: dict[str, tuple[tuple[str, float, tuple[float, ...]], ...]] = {
    "mapd-barefoot": (
        ("right_flat", 0.0, (0.0, 0.6042, -0.130636, -0.424192, 0.796332, -0.241504, 0.0901871,
                             0.833361, -0.295264, 0.226671)),
        ("right_toe", 0.398192, (0.21973, 0.615223, -0.0176658, -0.0249014, 0.599918, -0.495114,
                                 -0.681831, 0.631384, -0.190908, 0.11983)),
        ("left_flat", 0.614417, (0.381598, 0.61855, 0.0427962, 0.0869151, 0.661958, 0.00994285,
                                 -0.553464, 0.714097, -0.203428, -0.0227611)),
        ("left_toe", 0.89163, (0.526603, 0.628137, 0.116142, -0.708684, 0.796421, -0.312844,
                               -0.29631, 0.599992, -0.416909, -0.04259)),
    ),
    "mapd-orthosis": (
        ("right_flat", 0.0, (0.0, 0.650824, 0.190602, -0.700724, 0.806079, -0.13854, -0.0526658,
                             0.747579, 0.0906856, -0.274867)),
        ("right_toe", 0.417751, (0.194253, 0.675224, -0.0150412, 0.0700325, 0.438339, -0.236545,
                                 -0.527997, 0.564693, -0.0146634, 0.122879)),
        ("left_flat", 0.607506, (0.33038, 0.672471, -0.0146307, 0.0696615, 0.71228, 0.0480302,
                                 -0.392579, 0.660481, -0.0958536, 0.0532109)),
        ("left_toe", 0.927606, (0.518673, 0.688193, 0.287884, -0.812747, 0.645392, -0.00412035,
                                -0.291121, 0.455092, -0.14837, -0.29414)),
    ),
}  # fmt: skip

# Pelvis, right hip, knee, ankle, left hip, knee, ankle [rad] of MAPD-Orthosis at twelve equally
# spaced instants from 0 to 106 / 120 s.
SAMPLED_END = 106.0 / 120.0
SAMPLED = (
    (0.191, -0.701, 0.806, -0.139, -0.053, 0.748, 0.091),
    (0.257, -0.655, 0.813, -0.257, -0.252, 0.883, 0.05),
    (0.32, -0.579, 0.657, -0.193, -0.557, 0.957, -0.013),
    (0.235, -0.366, 0.534, -0.224, -0.715, 1, -0.015),
    (0.113, -0.167, 0.487, -0.203, -0.688, 0.836, -0.012),
    (-0.01, 0.049, 0.44, -0.217, -0.52, 0.555, 0.003),
    (-0.012, 0.126, 0.453, -0.291, -0.567, 0.656, -0.009),
    (-0.038, 0.195, 0.514, -0.165, -0.442, 0.662, -0.025),
    (0.076, -0.122, 0.846, 0.088, -0.442, 0.664, -0.141),
    (0.21, -0.454, 0.991, 0.072, -0.483, 0.662, -0.232),
    (0.214, -0.634, 0.998, 0.025, -0.363, 0.581, -0.269),
    (0.207, -0.729, 0.838, -0.009, -0.247, 0.476, -0.182),
)  # fmt: skip


@cache
def published_walker(condition: Condition) -> Walker:
    """Return the published model."""
    return build_walker(load_patient("sreenivasa2017-patient"), condition, published=True)


def sparse_gait(problem: str) -> Stride:
    """Return a published gait at a few instants."""
    phases, times, poses = zip(*INSTANTS[problem], strict=True)
    durations = np.array(DURATIONS[problem])
    end = np.array(poses[0])
    end[0] = DISTANCE[problem]
    return Stride(
        name=problem,
        problem=problem,
        walker=published_walker("orthosis" if "orthosis" in problem else "barefoot"),
        time=np.array([*times, durations.sum()]),
        phase=(*phases, contact_pattern().names[-1]),
        stances=phase_stances(contact_pattern(), durations),
        q=np.vstack([*poses, end]),
    )


@cache
def published_gait(problem: str) -> Stride:
    """Return a published gait from its files: every row, with forces and torques of LS-Barefoot."""
    table = _table(PUBLISHED / problem / "pathWalker2d.csv")
    time, q = table[:, 0], table[:, 1:]
    counts = [ROWS_PER_INTERVAL * n + 1 for n in INTERVALS[problem]]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    switching = np.append(time[starts], time[-1])
    known = _augmented(time.size) if problem == "ls-barefoot" else {}
    return Stride(
        name=problem,
        problem=problem,
        walker=published_walker("orthosis" if "orthosis" in problem else "barefoot"),
        time=time,
        phase=tuple(np.repeat(contact_pattern().names, counts)),
        stances=phase_stances(contact_pattern(), np.diff(switching)),
        q=q,
        **known,
    )


def _augmented(rows: int) -> dict[str, Any]:
    """Return activations, torques and forces of the published LS-Barefoot solution."""
    table = np.loadtxt(
        PUBLISHED / "ls-barefoot" / "pathWalker2d_augmented.txt", delimiter=",", usecols=range(91)
    )
    parts = np.split(table, np.cumsum([1, 10, 14, 14, 14, 14, 12]), axis=1)
    activation, torque = parts[2], parts[4]
    points = parts[7].reshape(-1, 4, 3)[:, :, [0, 2]]
    assert len(CONTACT_FORCES) == points[0].size
    tau = np.zeros((rows, 10))
    for i, muscle in enumerate(generators()):
        tau[:, COORDINATES.index(muscle.coordinate)] += torque[:, i]
    return {
        "force": {side: points[:, 2 * i : 2 * i + 2].sum(axis=1)
                  for i, side in enumerate(SIDES)},
        "net_torque": tau,
        "muscle_torque": torque,
        "activation": activation,
    }  # fmt: skip


def _table(path: Path) -> np.ndarray:
    """Return the rows of numbers in a published table."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        cells = [cell for cell in line.split(",") if cell.strip()]
        if len(cells) == 11 and not line.startswith("COLUMNS"):
            rows.append([float(cell) for cell in cells])
    return np.array(rows)


def sampled_gait() -> Stride:
    """Return the angles of the published MAPD-Orthosis gait from the instants kept here."""
    time = np.linspace(0.0, SAMPLED_END, 2000)
    q = np.zeros((time.size, 10))
    q[:, 2:9] = CubicSpline(np.linspace(0.0, SAMPLED_END, len(SAMPLED)), SAMPLED)(time)
    gait = sparse_gait("mapd-orthosis")
    return replace(gait, time=time, phase=("right_flat",) * time.size, q=q)
