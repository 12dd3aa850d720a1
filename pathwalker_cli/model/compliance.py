"""A sole that gives way: the force of the ground on it from how deep it sinks and how it slides.

References:
    Ackermann and van den Bogert (2010) J. Biomech. 43(6):1055-1060: the law of every contact point
    of their model of gait; stiffness, damping and sliding speed from its published source code.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.model.choices import SOLE_EDGE
from pathwalker_cli.model.contact import ContactPoint


def ground_force(
    place: ContactPoint,
    height: Any,
    velocity: tuple[Any, Any],
    numbers: Mapping[str, Any],
    weight: Any,
    friction: Any,
) -> tuple[Any, Any]:
    """Return the force of the ground on a sole, forward and up [N].

    With depth d below ground f_z = W (d / d_0)^3 (1 - c dz/dt) and f_x = -mu f_z tanh(v / (2 v_0)).
    Numbers, arrays of instants, or CasADi expressions.

    Args:
        place: The sole.
        height: Of its lowest point above the ground [m].
        velocity: Of the foot there, forward and up [m/s].
        numbers: Values of named numbers by address; `ContactPoint.law` says which count.
        weight: Body weight W [N].
        friction: Coefficient of friction mu.
    """
    sinks, damping, creep = (numbers[number.address] for number in place.law)
    forward, upward = velocity
    depth = ((height**2 + SOLE_EDGE**2) ** 0.5 - height) / 2.0
    load = weight * (depth / sinks) ** 3 * (1.0 - damping * upward)
    tanh = ca.tanh if isinstance(forward, ca.SX) else np.tanh
    return -friction * load * tanh(forward / (2.0 * creep)), load


def depth_under(
    place: ContactPoint, load: float, numbers: Mapping[str, float], weight: float
) -> float:
    """Return how deep a sole that rests bears a load [N] under body weight W [N]; [m]."""
    return float(numbers[place.law[0].address] * np.cbrt(max(load, 0.0) / weight))
