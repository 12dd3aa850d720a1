"""Segment masses and inertias against the numbers of the published models."""

from __future__ import annotations

import numpy as np
import pytest

from pathwalker_cli.conventions import Condition
from pathwalker_cli.model.anthropometry import Segment, segments
from pathwalker_cli.patient import load_patient

PATIENT = "sreenivasa2017-patient"
HEALTHY = "sreenivasa2017-healthy"


def parts(
    name: str, condition: Condition = "barefoot", published: bool = True
) -> dict[str, Segment]:
    """Return the segments of a shipped patient by name."""
    found = segments(load_patient(name), condition, published)
    return {segment.name: segment for segment in found}


def upper_body(found: dict[str, Segment]) -> tuple[float, float, float]:
    """Return mass [kg], height of the centre of mass [m] and Iyy [kg m^2] of trunk, head, arms."""
    heights: dict[str, float] = {"trunk": 0.0}
    for segment in found.values():
        if segment.parent in heights:
            heights[segment.name] = heights[segment.parent] + segment.origin[2]
    mass = np.array([found[name].mass for name in heights])
    z = np.array([height + found[name].com[2] for name, height in heights.items()])
    centre = mass @ z / mass.sum()
    own = sum(found[name].inertia[1] for name in heights)
    return mass.sum(), centre, own + mass @ (z - centre) ** 2


@pytest.mark.parametrize(
    ("name", "condition", "expected"),
    [
        (PATIENT, "barefoot", 24.69506),
        (PATIENT, "orthosis", 26.75506),
        (HEALTHY, "barefoot", 25.89482),
    ],
)
def test_total_mass(name: str, condition: Condition, expected: float) -> None:
    masses = [part.mass for part in segments(load_patient(name), condition)]
    assert sum(masses) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    ("name", "expected"),
    [(PATIENT, (12.967994, 0.216507, 0.341859)), (HEALTHY, (13.294055, 0.211542, 0.345645))],
)
def test_upper_body_of_the_published_models(name: str, expected: tuple[float, ...]) -> None:
    assert upper_body(parts(name)) == pytest.approx(expected, abs=1e-5)


def test_corrected_arm_hangs_lower() -> None:
    corrected, published = parts(PATIENT, published=False), parts(PATIENT)
    assert published["lower_arm_r"].origin[2] == pytest.approx(-0.1819)
    assert published["hand_r"].origin[2] == pytest.approx(-0.09328)
    assert corrected["lower_arm_r"].origin[2] == pytest.approx(-0.2099)
    assert corrected["hand_r"].origin[2] == pytest.approx(-0.1819)
    assert corrected["hand_l"] == published["hand_l"]
    assert upper_body(corrected)[1] < upper_body(published)[1]


def test_orthosis_scales_inertia_with_mass() -> None:
    bare, shod = parts(PATIENT), parts(PATIENT, "orthosis")
    for name, ratio in (("shank_r", 1.3049), ("foot_l", 2.4211), ("thigh_r", 1.0)):
        assert shod[name].mass / bare[name].mass == pytest.approx(ratio, abs=1e-4)
        assert shod[name].inertia[1] / bare[name].inertia[1] == pytest.approx(ratio, abs=1e-4)
        assert shod[name].com == bare[name].com


def test_thigh_by_hand() -> None:
    thigh = parts(PATIENT)["thigh_r"]
    assert thigh.mass == pytest.approx(24.7 * (0.06634 + 6 * 0.00364))
    com, gyration = 0.4758 - 6 * 0.00115, 0.5536 - 6 * 0.00133
    assert thigh.com == pytest.approx((0.0, 0.0, -com * 0.2647))
    assert thigh.inertia[1] == pytest.approx(thigh.mass * 0.2647**2 * (gyration**2 - com**2))


def test_foot_reaches_forward() -> None:
    foot = parts(PATIENT)["foot_l"]
    assert foot.com == pytest.approx(((0.4351 - 6 * 0.00186) * 0.13, 0.0, 0.0))


@pytest.mark.parametrize("name", [PATIENT, HEALTHY])
def test_inertias_are_those_of_a_body(name: str) -> None:
    for segment in parts(name).values():
        largest = max(segment.inertia)
        assert min(segment.inertia) > 0.0
        assert largest <= sum(segment.inertia) - largest + 1e-12
