"""Muscle torque generators and activation dynamics, equations (1) and (2).

References:
    Anderson, D.E., Madigan, M.L., Nussbaum, M.A. (2007) J. Biomech. 40, 3105-3113, table 3.
    Thelen, D.G., Anderson, F.C., Delp, S.L. (2003) J. Biomech. 36, 321-328.
    Winters, J.M., Stark, L. (1988) J. Biomech. 21, 1027-1041.
    Sreenivasa, M. et al. (2017) Front. Comput. Neurosci. 11:23.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import casadi as ca
import numpy as np

from pathwalker_cli.conventions import GENERATORS, SIDES, SUFFIX, generator_coordinate
from pathwalker_cli.model.elements import Curve, State, plain
from pathwalker_cli.model.elements.curves import BezierChain, SignedCurve, newton_steps_for
from pathwalker_cli.model.numbers import Number

ACTIVATION_TIME: Final = 0.011
"""Activation time constant tau_A [s], Winters and Stark (1988)."""
DEACTIVATION_TIME: Final = 0.068
"""Deactivation time constant tau_D [s], Winters and Stark (1988)."""


@dataclass(frozen=True)
class AndersonCurves:
    """Regression coefficients c1..c6 of one joint direction, men of 18 to 25 years.

    Args:
        strength: c1, peak isometric torque over body weight times height.
        angle_width: c2 [1/rad].
        best_angle: c3 [rad].
        speed_75: c4, speed at 75 % torque [rad/s].
        speed_50: c5, speed at 50 % torque [rad/s].
        eccentric: c6 [s/rad].

    References:
        Anderson et al. (2007), table 3.
    """

    strength: float
    angle_width: float
    best_angle: float
    speed_75: float
    speed_50: float
    eccentric: float

    @cached_property
    def active_torque_angle(self) -> BezierChain:
        """Smooth f_A(angle): the cosine bell, faded out to zero beyond 95 % of its half width."""
        half = np.pi / (2 * self.angle_width)
        reach = np.array([-1.05, -0.95, 0.0, 0.95, 1.05]) * half
        value = np.cos(self.angle_width * reach)
        slope = -self.angle_width * np.sin(self.angle_width * reach)
        value[[0, -1]] = slope[[0, -1]] = 0.0
        return _numeric_chain(self.best_angle + reach, value, slope, curviness=0.5)

    @cached_property
    def torque_angular_velocity(self) -> BezierChain:
        """Smooth f_V(speed): concentric hyperbola to zero torque, eccentric plateau."""
        last = 0.8 * abs(2 * self.speed_75 * self.speed_50 / (self.speed_50 - 3 * self.speed_75))
        y_last, s_last = self._concentric(last)
        end = 1.1 * (last - y_last / s_last)
        plateau = float(np.clip(1 + 3 * (self._eccentric(-np.pi / 3) - 1), 1.1, 1.4))
        inner = [self._concentric(w) for w in (0.0, self.speed_75, self.speed_50)]
        x = [-end, 0.0, self.speed_75, self.speed_50, last, end]
        y = [plateau, *(value for value, _ in inner), y_last, 0.0]
        slope = [0.0, *(rate for _, rate in inner), s_last, 0.0]
        return _numeric_chain(x, y, slope, curviness=0.7)

    def _concentric(self, speed: float) -> tuple[float, float]:
        """Return Anderson's concentric torque ratio and its slope at a speed [rad/s]."""
        top, c4, c5 = 2 * self.speed_75 * self.speed_50, self.speed_75, self.speed_50
        up, down = c5 - 3 * c4, 2 * c5 - 4 * c4
        value = (top + speed * up) / (top + speed * down)
        return value, top * (up - down) / (top + speed * down) ** 2

    def _eccentric(self, speed: float) -> float:
        """Return Anderson's eccentric torque ratio at a negative speed [rad/s]."""
        value, _ = self._concentric(-speed)
        return value * (1 - self.eccentric * speed)


def _numeric_chain(x: Any, y: Any, slopes: Any, curviness: float) -> BezierChain:
    """Return a chain of plain floats with just the Newton steps that it needs."""
    knots = (tuple(float(value) for value in column) for column in (x, y, slopes))
    chain = BezierChain(next(knots), next(knots), next(knots), curviness)
    return replace(chain, newton_steps=newton_steps_for(chain))


_ANDERSON: Final = {
    "hip_extension": (-1.0, 1.0, AndersonCurves(0.161, 0.958, 0.932, 1.578, 3.190, 0.242)),
    "hip_flexion": (-1.0, -1.0, AndersonCurves(0.113, 0.738, -0.214, 2.095, 4.267, 0.218)),
    "knee_extension": (1.0, -1.0, AndersonCurves(0.163, 1.258, 1.133, 1.517, 3.952, 0.095)),
    "knee_flexion": (1.0, 1.0, AndersonCurves(0.087, 0.869, 0.522, 2.008, 5.233, 0.304)),
    "ankle_extension": (-1.0, 1.0, AndersonCurves(0.095, 1.391, 0.408, 0.987, 3.558, 0.295)),
    "ankle_flexion": (-1.0, -1.0, AndersonCurves(0.033, 1.510, -0.187, 0.699, 1.940, 0.828)),
}
"""Signs of the curve's angle and of the torque in the coordinates of `conventions`, and Anderson et
al. (2007), table 3."""


def _anderson(generator: str) -> tuple[float, float, AndersonCurves]:
    """Return the row of a generator, e.g. "knee_flexion_l"; the trunk uses those of the hip."""
    joint, action = generator.split("_")[:2]
    return _ANDERSON[f"{'hip' if joint == 'lumbar' else joint}_{action}"]


def curves_of(generator: str) -> AndersonCurves:
    """Return the curves of a generator."""
    return _anderson(generator)[2]


@dataclass(frozen=True)
class MuscleTorqueGenerator:
    """One torque actuator: tau = s_T tau_0 a f_A(s_A q) f_V(s_T v), equation (1).

    Args:
        name: Name in `conventions.GENERATORS`.
        angle_sign: s_A, +1 or -1.
        torque_sign: s_T, +1 or -1.
        curves: Its torque-angle and torque-velocity curves.
    """

    name: str
    angle_sign: float
    torque_sign: float
    curves: AndersonCurves

    @property
    def coordinate(self) -> str:
        """Coordinate that the generator drives."""
        return generator_coordinate(self.name)

    @property
    def coordinates(self) -> tuple[str]:
        """The coordinate that the generator drives, as an element has it."""
        return (self.coordinate,)

    @cached_property
    def numbers(self) -> tuple[Number]:
        """Its strength, the maximum isometric torque tau_0."""
        stem, _, suffix = self.name.rpartition("_")
        side = next((s for s in SIDES if SUFFIX[s] == suffix), None)
        kind = self.name if side is None else stem
        place = f"strengths.{kind}"
        words = f"strength of {kind.replace('_', ' ')}"
        address = place if side is None else f"{place}.{side}"
        return (Number(address, f"{kind}_strength", words, "N m", side),)

    @cached_property
    def angle_factor(self) -> SignedCurve:
        """f_A as a function of the joint angle q [rad], dimensionless."""
        return SignedCurve(self.curves.active_torque_angle, self.angle_sign)

    @cached_property
    def velocity_factor(self) -> SignedCurve:
        """f_V as a function of the joint speed v [rad/s], dimensionless."""
        return SignedCurve(self.curves.torque_angular_velocity, self.torque_sign)

    def torque(
        self, q: Any, v: Any, activation: Any, max_isometric_torque: Any, curve: Curve = plain
    ) -> Any:
        """Return the signed joint torque [N m], equation (1).

        Args:
            q: Joint angle [rad].
            v: Joint speed [rad/s].
            activation: Activation in [0, 1].
            max_isometric_torque: tau_0 [N m], positive.
            curve: Evaluates the two curves.
        """
        factor = curve(self.angle_factor, q) * curve(self.velocity_factor, v)
        return self.torque_sign * max_isometric_torque * activation * factor

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return the signed joint torque [N m]; see `ForceElement.forces`."""
        (strength,) = self.numbers
        q, v = state.q[self.coordinate], state.v[self.coordinate]
        a = state.activation[self.name]
        return (self.torque(q, v, a, numbers[strength.address], curve),)


def generators() -> tuple[MuscleTorqueGenerator, ...]:
    """Return the 14 generators in the order of `conventions.GENERATORS`."""
    return tuple(MuscleTorqueGenerator(name, *_anderson(name)) for name in GENERATORS)


def activation_rate(excitation: Any, activation: Any) -> Any:
    """Return the activation rate of a muscle, equation (2).

    Args:
        excitation: Neural excitation e in [0, 1], shape (m,).
        activation: Muscle activation a in [0, 1], shape (m,).

    Returns:
        da/dt [1/s], shape (m,).

    References:
        Thelen et al. (2003); time constants from Winters and Stark (1988).
    """
    difference = excitation - activation
    rising = excitation / ACTIVATION_TIME + (1 - excitation) / DEACTIVATION_TIME
    choose = ca.if_else if isinstance(difference, ca.SX | ca.MX) else np.where
    return difference * choose(difference >= 0, rising, 1 / DEACTIVATION_TIME)


def excitation_from_rate(rate: Any, activation: Any) -> Any:
    """Return the neural excitation that gives an activation rate: the inverse of equation (2).

    For fixed a, equation (2) increases strictly in e, so 0 <= e <= 1 is the same as
    -a / tau_D <= da/dt <= (1 - a) / tau_A.

    Args:
        rate: da/dt [1/s], any shape.
        activation: Muscle activation a in [0, 1], same shape.

    Returns:
        e, same shape.
    """
    faster = 1 / ACTIVATION_TIME - 1 / DEACTIVATION_TIME
    linear = 1 / DEACTIVATION_TIME - activation * faster
    symbolic = isinstance(rate, ca.SX | ca.MX)
    # the branch that is not taken must be finite too, and so must its derivative
    upward = ca.fmax(rate, 0.0) if symbolic else np.maximum(rate, 0.0)
    constant = -(activation / DEACTIVATION_TIME + upward)
    root = (ca.sqrt if symbolic else np.sqrt)(linear**2 - 4 * faster * constant)
    rising = (-linear + root) / (2 * faster)
    choose = ca.if_else if symbolic else np.where
    return choose(rate < 0, activation + DEACTIVATION_TIME * rate, rising)
