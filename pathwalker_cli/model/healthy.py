"""How strong a healthy child of some size is: the shipped healthy child, grown or shrunk.

A torque is a force, which grows with body mass, times a lever, which grows with height.
"""

from __future__ import annotations

from functools import cache

from pathwalker_cli.patient import Patient, load_patient

__all__ = ["healthy_child", "healthy_strength"]


@cache
def healthy_child() -> Patient:
    """Return the healthy child that strengths are compared with."""
    return load_patient("sreenivasa2017-healthy")


def healthy_strength(name: str, body_mass: float, height: float) -> float:
    """Return a maximum isometric torque of a healthy child [N m].

    Args:
        name: Field of `Strengths`, e.g. "hip_extension".
        body_mass: Body mass of the child [kg].
        height: Height of the child [m].
    """
    child = healthy_child()
    assert child.strengths is not None  # noqa: S101 - a shipped patient
    given = getattr(child.strengths, name)
    value = given if isinstance(given, float) else given.right
    return float(value) * (body_mass * height) / (child.body_mass * child.height)
