"""Gait as a multi-phase optimal control problem, equations (3) to (7), (9) and (10).

States are q and v; algebraic variables are accelerations, the contact forces of the phase and
reserve forces (zero but in the first stage of a solve); smooth states are the activations and the
controls their rates.  For fixed a, equation (2) increases strictly in the excitation e, so
0 <= e <= 1 is the same as -a / tau_D <= da/dt <= (1 - a) / tau_A: no kink and no excitation needed.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Final, Literal

import casadi as ca
import numpy as np

from pathwalker_cli.conventions import (
    CONTACT_FORCES,
    CONTACT_POINTS,
    COORDINATES,
    GENERATORS,
    SIDES,
    STIFFNESSES,
)
from pathwalker_cli.gait.boundary import gait_boundary
from pathwalker_cli.gait.goals import Goals
from pathwalker_cli.model.contact import PHASES, ContactPhase
from pathwalker_cli.model.curves import BezierChain, evaluate
from pathwalker_cli.model.muscle import ACTIVATION_TIME, DEACTIVATION_TIME, excitation_from_rate
from pathwalker_cli.model.orthosis import OrthosisSide, orthosis_torque
from pathwalker_cli.model.walker import ANKLES, GENERATOR_ROWS, Walker
from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.ocp.problem import (
    INFINITY,
    Boundary,
    MultiPhaseProblem,
    Phase,
    Rows,
    Variables,
)

__all__ = [
    "EXCITATION",
    "INTEGRALS",
    "STIFFNESSES",
    "WEIGHTS",
    "Form",
    "GaitProblem",
    "GaitWeights",
]

VELOCITIES: Final = tuple(f"{name}_velocity" for name in COORDINATES)
ACCELERATIONS: Final = tuple(f"{name}_acceleration" for name in COORDINATES)
RESERVES: Final = tuple(f"{name}_reserve" for name in COORDINATES)
ACTIVATIONS: Final = tuple(f"{name}_activation" for name in GENERATORS)
RATES: Final = tuple(f"{name}_rate" for name in GENERATORS)
INTEGRALS: Final = ("effort", "rate", "acceleration", "tracking", "reserve")
"""Running costs of every gait: the sums of a^2 (or a higher power), (rate / 20)^2, (vdot / 50)^2,
(q - q_ref)^2 and (reserve / 20)^2."""
EXCITATION: Final = "excitation"
"""A further running cost of a passage: the sum of the squared excitations."""

Form = Literal["stride", "step", "passage"]
"""A periodic stride of eight phases, one step of a symmetric gait, or a stride from a recording
that need not be periodic."""

# What counts as 1 for the solver; with these the prototypes needed the fewest iterations.
_VELOCITY, _ACCELERATION, _FORCE, _TORQUE = 5.0, 50.0, 100.0, 20.0
_RATE, _STIFFNESS, _HEIGHT = 20.0, 50.0, 0.1


@dataclass(frozen=True)
class GaitWeights:
    """Weights of the cost terms.

    Args:
        effort: Weight of the effort per distance, equation (9).
        rate: Weight of the squared activation rates per distance (regularisation).
        acceleration: Weight of the squared accelerations per distance (regularisation).
        walking_speed: lambda of equation (10).
        tracking: Weight of the integral of (q - q_ref)^2.
        reserve: Weight of the integral of the squared reserve forces.
        smoothing: Weight of the integrals of squared activations and rates, not per distance.
        fit: Weight of the sum over recorded instants of (q - q_recorded)^2, equation (8).
        excitation: delta of equation (8), weight of the integral of the squared excitations.
        goals: Weights of clinical goals by name.
    """

    effort: float = 1.0
    rate: float = 1e-3
    acceleration: float = 0.0
    walking_speed: float = 0.0
    tracking: float = 0.0
    reserve: float = 0.0
    smoothing: float = 0.0
    fit: float = 0.0
    excitation: float = 0.0
    goals: Mapping[str, float] = field(default_factory=dict)

    def vector(self, goals: Sequence[str] = ()) -> np.ndarray:
        """Return the weights in the order of `WEIGHTS`, then those of these goals."""
        own = [getattr(self, name) for name in WEIGHTS]
        return np.array([*own, *(self.goals.get(name, 0.0) for name in goals)])


WEIGHTS: Final = (
    "effort",
    "rate",
    "acceleration",
    "walking_speed",
    "tracking",
    "reserve",
    "smoothing",
    "fit",
    "excitation",
)


class _Constants:
    """Symbols of the numbers that a patient and a config bring in, and their values."""

    def __init__(self, walker: Walker, goals: Goals) -> None:
        body = walker.rigid_body
        self.theta = ca.SX.sym("theta", len(body.parameter_names))
        self.strength = ca.SX.sym("strength", len(GENERATORS))
        self.friction = ca.SX.sym("friction")
        self.weights = ca.SX.sym("weights", len(WEIGHTS) + len(goals.names))
        self.goal_numbers = ca.SX.sym("goal_numbers", goals.size)
        self._sides = [] if walker.orthosis is None else [ca.SX.sym(s, 7) for s in SIDES]

    @property
    def vector(self) -> ca.SX:
        """All constants, one after the other."""
        return ca.vertcat(
            self.theta,
            self.strength,
            self.friction,
            self.weights,
            *self._sides,
            self.goal_numbers,
        )

    @property
    def sides(self) -> tuple[OrthosisSide, ...]:
        """Symbolic orthosis parameters right and left, or none."""
        return tuple(OrthosisSide(*ca.vertsplit(side)) for side in self._sides)

    @staticmethod
    def values(
        walker: Walker,
        goals: Goals,
        weights: GaitWeights,
        friction: float,
        orthosis_share: float,
    ) -> np.ndarray:
        """Return the values in the order of `vector`."""
        sides = [side.scaled(orthosis_share) for side in walker.orthosis or ()]
        return np.concatenate(
            [
                walker.rigid_body.parameters,
                walker.max_isometric_torque,
                [friction],
                weights.vector(goals.names),
                *(list(vars(side).values()) for side in sides),
                goals.numbers(walker.weight),
            ]
        )


def _curve_expansion(chain: BezierChain, sign: float, x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return value, slope and curvature of a curve of sign * x."""
    point = evaluate(chain, sign * x)
    return point.value, sign * point.slope, point.curvature


def _orthosis_expansion(side: OrthosisSide, *arguments: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return orthosis torque, its gradient and its Hessian in angle, K_D and K_P."""
    x = ca.SX.sym("x", 3)
    parameters = ca.vertcat(*vars(side).values())
    torque = orthosis_torque(side, *ca.vertsplit(x))
    hessian, gradient = ca.hessian(torque, x)
    terms = ca.Function("orthosis", [x, parameters], [torque, gradient, hessian])
    value, slope, bend = terms(ca.vertcat(*arguments), parameters)
    return value, slope, bend


class GaitProblem:
    """Builds the `MultiPhaseProblem` of a walker.

    Args:
        walker: The walker; its condition decides whether there are stiffnesses to find.
        form: What the phases are.
        goals: Clinical goals, and the power of the effort.
    """

    def __init__(self, walker: Walker, form: Form = "stride", goals: Goals | None = None) -> None:
        self.walker = walker
        self.form = form
        self.goals = goals or Goals()
        self.phases = PHASES[: len(PHASES) // 2] if form == "step" else PHASES
        last = (EXCITATION,) if form == "passage" else ()
        self.integrals = (*INTEGRALS, *self.goals.integrals, *last)
        self.constants = _Constants(walker, self.goals)
        scale = np.concatenate([np.ones(len(COORDINATES)), np.full(len(COORDINATES), _VELOCITY)])
        self.states = Variables.make("x", COORDINATES + VELOCITIES, scale)
        self.activations = Variables.make("a", ACTIVATIONS, 1.0)
        self.rates = Variables.make("rate", RATES, _RATE)
        names = STIFFNESSES if walker.orthosis else ()
        self.stiffness = Variables.make("stiffness", names, _STIFFNESS)
        self.reference = ca.SX.sym("q_ref", len(COORDINATES))

    @property
    def structure(self) -> Hashable:
        """What the expressions depend on; problems of equal structure differ in numbers only."""
        body = self.walker.rigid_body
        names, worn = tuple(body.parameter_names), self.walker.orthosis is not None
        return self.form, body.backend, body.topology, names, worn, self.goals.structure

    @property
    def q(self) -> ca.SX:
        """Generalised coordinates."""
        return self.states.symbol[: len(COORDINATES)]

    @property
    def v(self) -> ca.SX:
        """Generalised velocities."""
        return self.states.symbol[len(COORDINATES) :]

    def build(self) -> MultiPhaseProblem:
        """Return the problem's structure."""
        following = [PHASES[(i + 1) % len(PHASES)] for i in range(len(self.phases))]
        return MultiPhaseProblem(
            states=self.states,
            smooth=self.activations,
            controls=self.rates,
            parameters=self.stiffness,
            shared=self.constants.vector,
            point_data=self.reference,
            integrals=self.integrals,
            integral_scale=np.ones(len(self.integrals)),
            phases=tuple(self._phase(*pair) for pair in zip(self.phases, following, strict=True)),
            node_rows=self._excitation_rows(),
            boundary=self._boundary(),
            sample=self._sample(),
        )

    def shared_values(
        self, weights: GaitWeights, friction: float, orthosis_share: float = 1.0
    ) -> np.ndarray:
        """Return the numbers that go with `MultiPhaseProblem.shared`.

        Args:
            weights: Weights of the cost terms.
            friction: Coefficient of friction.
            orthosis_share: Share of the orthosis' fixed torques, below 1 to ease in a start.
        """
        return self.constants.values(self.walker, self.goals, weights, friction, orthosis_share)

    @cached_property
    def _torques(self) -> tuple[ca.SX, FrozenTerms]:
        """Generalised forces of muscles and orthoses (10,) [N m], with frozen curves."""
        tau, frozen = ca.SX(len(COORDINATES), 1), FrozenTerms()
        for i, (g, row) in enumerate(zip(self.walker.generators, GENERATOR_ROWS, strict=True)):
            angle = partial(_curve_expansion, g.curves.active_torque_angle, g.angle_sign)
            speed = partial(_curve_expansion, g.curves.torque_angular_velocity, g.torque_sign)
            factor = frozen.taylor(angle, self.q[row]) * frozen.taylor(speed, self.v[row])
            peak = g.torque_sign * self.constants.strength[i]
            tau[row] += peak * self.activations.symbol[i] * factor
        for i, (side, row) in enumerate(zip(self.constants.sides, ANKLES, strict=False)):
            springs = self.stiffness.symbol[i], self.stiffness.symbol[i + 2]
            expansion = partial(_orthosis_expansion, side)
            tau[row] += frozen.taylor(expansion, self.q[row], *springs)
        return tau, frozen

    def _phase(self, contact: ContactPhase, following: ContactPhase) -> Phase:
        body, theta = self.walker.rigid_body, self.constants.theta
        names = ACCELERATIONS + contact.forces + RESERVES
        counts = [len(ACCELERATIONS), len(contact.forces), len(RESERVES)]
        scale = np.repeat([_ACCELERATION, _FORCE, _TORQUE], counts)
        z = Variables.make("z", names, scale)
        vdot, force, reserve = ca.vertsplit(z.symbol, np.cumsum([0, *counts]).tolist())
        tau, frozen = self._torques
        active = list(contact.indices)
        jacobian = body.point_jacobian(self.q, theta)[active, :]
        balance = body.inverse_dynamics(self.q, self.v, vdot, theta) - tau - reserve
        balance -= jacobian.T @ force
        motion = self._point_motion(vdot)
        residual = Rows.join(
            Rows.make(balance, tuple(f"{n} equation of motion" for n in COORDINATES), _TORQUE),
            Rows.make(
                motion["acceleration"][active],
                tuple(f"{n} contact acceleration" for n in contact.forces),
                _TORQUE,
            ),
        )
        return Phase(
            name=contact.name,
            algebraic=z,
            derivative=ca.vertcat(self.v, vdot),
            residual=residual,
            path=self._path(contact, force, motion["position"]),
            end=self._touch_down(contact.touched_down(following), motion),
            fixed_at_end=self._fixed_at_end(contact, following),
            integrands=self._integrands(contact, vdot, force, reserve),
            frozen=frozen,
        )

    def _point_motion(self, vdot: ca.SX) -> dict[str, ca.SX]:
        """Return positions, velocities and accelerations of the contact points, (8,) each."""
        body, theta = self.walker.rigid_body, self.constants.theta
        return {
            "position": body.point_positions(self.q, theta),
            "velocity": body.point_velocities(self.q, self.v, theta),
            "acceleration": body.point_accelerations(self.q, self.v, vdot, theta),
        }

    def _integrands(
        self, contact: ContactPhase, vdot: ca.SX, force: ca.SX, reserve: ca.SX
    ) -> ca.SX:
        a, numbers = self.activations.symbol, ca.vertsplit(self.constants.goal_numbers)
        q, v, activation, load = (ca.vertsplit(x) for x in (self.q, self.v, a, force))
        terms = [
            ca.sum1(a**self.goals.activation_power),
            ca.sumsqr(self.rates.symbol / _RATE),
            ca.sumsqr(vdot / _ACCELERATION),
            ca.sumsqr(self.q - self.reference),
            ca.sumsqr(reserve / _TORQUE),
            *self.goals.integrands(contact, q, v, activation, load, numbers),
        ]
        if EXCITATION in self.integrals:
            excitation = excitation_from_rate(self.rates.symbol, a)
            terms.append(ca.sumsqr(excitation))
        return ca.vertcat(*terms)

    def _sample(self) -> ca.SX:
        """Return the cost of one recorded instant of a passage."""
        if self.form != "passage":
            return ca.SX(0)
        return self.constants.weights[WEIGHTS.index("fit")] * ca.sumsqr(self.q - self.reference)

    def _path(self, contact: ContactPhase, force: ca.SX, position: ca.SX) -> Rows:
        """Return heights of the points in the air and the friction cones of the loaded feet."""
        airborne = [p for p in CONTACT_POINTS if p not in contact.points]
        heights = [position[CONTACT_FORCES.index(f"{p}_z")] for p in airborne]
        rows = [
            Rows.make(
                ca.vertcat(*heights), tuple(f"{p} height" for p in airborne), _HEIGHT, 0.0, INFINITY
            )
        ]
        for side in sorted({point[-1] for point in contact.points}):
            parts = [(n, force[i]) for i, n in enumerate(contact.forces) if n[-3] == side]
            normal = sum(f for n, f in parts if n.endswith("z"))
            tangent = sum(f for n, f in parts if n.endswith("x"))
            cone = self.constants.friction * normal
            names = (f"foot_{side} forward friction", f"foot_{side} backward friction")
            value = ca.vertcat(cone - tangent, cone + tangent)
            rows.append(Rows.make(value, names, _FORCE, 0.0, INFINITY))
        return Rows.join(*rows)

    def _touch_down(self, directions: tuple[str, ...], motion: Mapping[str, ca.SX]) -> Rows:
        """Return the rows that let new points meet the ground without impact and without force.

        Zero acceleration of a new point just before contact is the same as zero force just after.
        """
        index = [CONTACT_FORCES.index(n) for n in directions]
        vertical = [n for n in directions if n.endswith("z")]
        lifts = [CONTACT_FORCES.index(n) for n in vertical]
        return Rows.join(
            Rows.make(
                motion["position"][lifts], tuple(f"{n[:-2]} touch-down" for n in vertical), _HEIGHT
            ),
            Rows.make(
                motion["velocity"][index],
                tuple(f"{n} touch-down velocity" for n in directions),
                1.0,
            ),
            Rows.make(
                motion["acceleration"][index],
                tuple(f"{n} touch-down force" for n in directions),
                _TORQUE,
            ),
        )

    @staticmethod
    def _fixed_at_end(contact: ContactPhase, following: ContactPhase) -> tuple[str, ...]:
        """Return the path rows that touch-down or lift-off already fix at the end of a phase."""
        landing = {n[:-2] for n in contact.touched_down(following)}
        leaving = {p[-1] for p in contact.points} - {p[-1] for p in following.points}
        return (
            *(f"{p} height" for p in landing),
            *(f"foot_{s} {d} friction" for s in leaving for d in ("forward", "backward")),
        )

    def _excitation_rows(self) -> Rows:
        """Return 0 <= e <= 1 as two linear rows in activation and rate."""
        a, rate = self.activations.symbol, self.rates.symbol
        return Rows.join(
            Rows.make(
                DEACTIVATION_TIME * rate + a,
                tuple(f"{n} excitation above 0" for n in GENERATORS),
                1.0,
                0.0,
                INFINITY,
            ),
            Rows.make(
                ACTIVATION_TIME * rate + a,
                tuple(f"{n} excitation below 1" for n in GENERATORS),
                1.0,
                -INFINITY,
                1.0,
            ),
        )

    def _boundary(self) -> Boundary:
        names = (*WEIGHTS, *self.goals.names)
        weights = dict(zip(names, ca.vertsplit(self.constants.weights), strict=True))
        return gait_boundary(
            (self.states, self.activations, self.rates),
            self.stiffness,
            self.integrals,
            weights,
            self.goals,
            len(self.phases),
            self.form == "step",
            self._standing() if self.form == "passage" else None,
        )

    def _standing(self) -> Rows:
        """Return the rows that let the first phase begin on the ground and at rest there."""
        contact, motion = self.phases[0], self._point_motion(ca.SX.zeros(len(COORDINATES)))
        vertical = [n for n in contact.forces if n.endswith("z")]
        return Rows.join(
            Rows.make(
                motion["position"][[CONTACT_FORCES.index(n) for n in vertical]],
                tuple(f"{n[:-2]} height at the start" for n in vertical),
                _HEIGHT,
            ),
            Rows.make(
                motion["velocity"][list(contact.indices)],
                tuple(f"{n} velocity at the start" for n in contact.forces),
                1.0,
            ),
        )
