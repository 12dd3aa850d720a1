"""Gait as a multi-phase optimal control problem, equations (3) to (7), (9) and (10).

States are q and v; algebraic variables are accelerations, the contact forces of the phase and
reserve forces (zero but in the first stage of a solve); smooth states are the activations and the
controls their rates.  For fixed a, equation (2) increases strictly in the excitation e, so
0 <= e <= 1 is the same as -a / tau_D <= da/dt <= (1 - a) / tau_A: no kink and no excitation needed.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Final, Literal, cast

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import COORDINATES, GENERATORS, SIDES, SUFFIX, Side
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.boundary import gait_boundary
from pathwalker_cli.gait.costs import SHIPPED, Costs, Instant, Weights
from pathwalker_cli.model.compliance import ground_force
from pathwalker_cli.model.contact import ContactForce, ContactPhase
from pathwalker_cli.model.elements import REGISTERED, element_forces, generalised_forces
from pathwalker_cli.model.elements.muscle import (
    ACTIVATION_TIME,
    DEACTIVATION_TIME,
    excitation_from_rate,
)
from pathwalker_cli.model.skeleton import Skeleton
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape_store import Makers, cache_folder, keep_tapes, kept_tapes
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.problem import INFINITY, Boundary, MultiPhaseProblem, Phase, Rows, Variables

ACTIVATIONS: Final = tuple(f"{name}_activation" for name in GENERATORS)
RATES: Final = tuple(f"{name}_rate" for name in GENERATORS)
Form = Literal["stride", "step", "passage"]
"""A periodic stride of eight phases, one step of a symmetric gait, or a stride from a recording
that need not be periodic."""

_MAKERS: Final[Makers] = (
    pin.__version__,
    Path(str(resources.files("pathwalker_cli.model.backends") / "libpinocchio_casadi.so")),
)
"""What makes the expressions of a gait beside the sources: Pinocchio, and its compiled back end."""

_BUILT: Final[dict[Hashable, CollocationBlocks]] = {}


class _Constants:
    """Symbols of the numbers that a patient and a config bring in, and their values."""

    def __init__(self, walker: Walker, costs: Costs) -> None:
        self._walker, self._costs = walker, costs
        self.theta = ca.SX.sym("theta", len(walker.rigid_body.parameter_names))
        self.numbers = {number.address: ca.SX.sym(number.full_name) for number in walker.numbers}
        self.friction, self.weight = ca.SX.sym("friction"), ca.SX.sym("weight")
        self.weights = ca.SX.sym("weights", len(costs.weighed))
        self.cost_numbers = ca.SX.sym("cost_numbers", costs.size)
        self.moving = tuple(
            number
            for unknown in walker.unknowns
            for number in unknown.numbers
            if number in walker.parts.body_numbers
        )
        self.slopes = [ca.SX.sym(f"{n.full_name}_slope", self.theta.numel()) for n in self.moving]

    @property
    def vector(self) -> ca.SX:
        """All constants, one after the other."""
        numbers, ground = self.numbers.values(), (self.friction, self.weight)
        rest = self.weights, self.cost_numbers
        return ca.vertcat(self.theta, *numbers, *ground, *rest, *self.slopes)

    def values(self, weights: Weights, friction: float, share: float) -> np.ndarray:
        """Return the values in the order of `vector`; of what is faded only a share acts."""
        walker, costs = self._walker, self._costs
        numbers = [walker.values[n.address] * (share if n.faded else 1.0) for n in walker.numbers]
        return np.concatenate(
            [
                walker.rigid_body.parameters,
                numbers,
                [friction, walker.weight],
                [weights.get(name, 0.0) for name in costs.weighed],
                costs.numbers(walker),
                *map(walker.body_slopes, self.moving),
            ]
        )


def _expansion(
    function: Callable[..., ca.SX], arguments: Sequence[ca.SX], moving: Sequence[int]
) -> Callable[..., tuple[ca.SX, ca.SX, ca.SX]]:
    """Return what gives value, gradient and Hessian of a function in some of its arguments."""
    if hasattr(function, "expansion") and len(arguments) == 1:
        return cast("Callable[..., tuple[ca.SX, ca.SX, ca.SX]]", function.expansion)
    fixed = [i for i in range(len(arguments)) if i not in moving]

    def expanded(*at: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        x, rest = ca.SX.sym("x", len(moving)), ca.SX.sym("rest", len(fixed))
        places = dict(zip((*moving, *fixed), ca.vertsplit(x) + ca.vertsplit(rest), strict=True))
        value = function(*(places[i] for i in range(len(arguments))))
        hessian, gradient = ca.hessian(value, x)
        terms = ca.Function("expansion", [x, rest], [value, gradient, hessian])
        result = terms(ca.vertcat(*at), ca.vertcat(*(arguments[i] for i in fixed)))
        return result[0], result[1], result[2]

    return expanded


class GaitProblem:
    """Builds the `MultiPhaseProblem` of a walker.

    Args:
        walker: The walker; its unknowns are the free parameters.
    """

    def __init__(self, walker: Walker, form: Form = "stride", costs: Costs | None = None) -> None:
        self.walker = walker
        self.form = form
        self.costs = replace(costs or Costs(), passage=form == "passage")
        self.pattern = walker.pattern
        self.phases = self.pattern.steps[0] if form == "step" else self.pattern.phases
        self.constants = _Constants(walker, self.costs)
        skeleton = walker.skeleton
        scale = np.repeat([1.0, choices.VELOCITY_SIZE], skeleton.size)
        self.states = Variables.make("x", skeleton.coordinates + skeleton.named("velocity"), scale)
        self.q, self.v = ca.vertsplit(self.states.symbol, skeleton.size)
        self.activations = Variables.make("a", ACTIVATIONS, 1.0)
        self.rates = Variables.make("rate", RATES, choices.RATE_SIZE)
        names = tuple(unknown.name for unknown in walker.unknowns)
        sizes = np.array([unknown.scale for unknown in walker.unknowns])
        self.parameters = Variables.make("parameters", names, sizes)
        self.reference = ca.SX.sym("q_ref", skeleton.size)

    @property
    def structure(self) -> Hashable:
        """What the expressions depend on; problems of equal structure differ in numbers only."""
        body = self.walker.rigid_body
        names, free = tuple(body.parameter_names), self.walker.unknowns
        elements = tuple((type(e).__name__, e.name) for e in self.walker.elements)
        contact = body.topology, self.walker.parts.feet, self.walker.parts.contact
        return self.form, body.backend, contact, names, elements, free, self.costs.structure

    @property
    def shipped(self) -> bool:
        """Whether all of it comes with this package: the structure tells nothing of other code."""
        others = {element.name for parts in REGISTERED.values() for element in parts}
        return SHIPPED.issuperset(self.costs.names) and not others.intersection(
            element.name for element in self.walker.elements
        )

    def build(self) -> MultiPhaseProblem:
        """Return the problem's structure."""
        following = self.pattern.following[: len(self.phases)]
        return MultiPhaseProblem(
            states=self.states,
            smooth=self.activations,
            controls=self.rates,
            parameters=self.parameters,
            shared=self.constants.vector,
            point_data=self.reference,
            integrals=self.costs.integrals,
            integral_scale=np.ones(len(self.costs.integrals)),
            phases=tuple(self._phase(*pair) for pair in zip(self.phases, following, strict=True)),
            node_rows=self._excitation_rows(),
            boundary=self._boundary(),
            sample=self._sample(),
        )

    def shared_values(
        self, weights: Weights, friction: float, orthosis_share: float = 1.0
    ) -> np.ndarray:
        """Return the numbers that go with `MultiPhaseProblem.shared`.

        Below 1, `orthosis_share` eases in the orthosis' fixed torques.
        """
        return self.constants.values(weights, friction, orthosis_share)

    @cached_property
    def _free(self) -> dict[str, ca.SX]:
        """Symbols of the unknowns by the addresses that they set."""
        symbols = ca.vertsplit(self.parameters.symbol)
        chosen = zip(self.walker.unknowns, symbols, strict=True)
        return {address: symbol for unknown, symbol in chosen for address in unknown.addresses}

    @cached_property
    def _theta(self) -> ca.SX:
        """Numbers of the rigid bodies, shifted by the free numbers that they depend on."""
        theta, constants = self.constants.theta, self.constants
        for number, slope in zip(constants.moving, constants.slopes, strict=True):
            address = number.address
            theta = theta + slope * (self._free[address] - constants.numbers[address])
        return theta

    @cached_property
    def _torques(self) -> tuple[ca.SX, ca.SX, FrozenTerms]:
        """Forces of all elements [N m] and their sum (10,) [N, N m], with frozen curves."""
        frozen, walker = FrozenTerms(), self.walker
        moving = ca.vertcat(self.states.symbol, self.activations.symbol, self.parameters.symbol)

        def curve(function: Callable[..., ca.SX], *arguments: ca.SX) -> ca.SX:
            varying = [i for i, x in enumerate(arguments) if ca.depends_on(ca.SX(x), moving)]
            expansion = _expansion(function, arguments, varying)
            return frozen.taylor(expansion, *(arguments[i] for i in varying))

        state = walker.state(*map(ca.vertsplit, (self.q, self.v, self.activations.symbol)))
        numbers = {**self.constants.numbers, **self._free}
        forces = element_forces(walker.elements, state, numbers, curve)
        names = walker.skeleton.coordinates
        total = generalised_forces(walker.elements, forces, names, ca.SX(1, 1))
        return ca.vertcat(*forces), ca.vertcat(*total), frozen

    def _phase(self, contact: ContactPhase, following: ContactPhase) -> Phase:
        body, theta, skeleton = self.walker.rigid_body, self._theta, self.walker.skeleton
        names = algebraic_names(skeleton, contact)
        counts = [skeleton.size, len(contact.forces), skeleton.size]
        sizes = choices.ACCELERATION_SIZE, choices.CONTACT_FORCE_SIZE, choices.FORCE_SIZE
        z = Variables.make("z", names, np.repeat(sizes, counts))
        vdot, force, reserve = ca.vertsplit(z.symbol, np.cumsum([0, *counts]).tolist())
        _, tau, frozen = self._torques
        position, velocity, acceleration = self._point_motion(vdot)
        jacobian = self._of(body.point_jacobian(self.q, theta), contact.forces)
        balance = body.inverse_dynamics(self.q, self.v, vdot, theta) - tau - reserve
        balance -= jacobian.T @ force
        equations = tuple(f"{name} equation of motion" for name in skeleton.coordinates)
        law = self._ground_forces(position, velocity)
        soft = [contact.forces.index(f) for f in contact.yielding]
        laws = tuple(f"{f.name} force" for f in contact.yielding)
        still = "{0.name} contact acceleration"
        return Phase(
            name=contact.name,
            algebraic=z,
            derivative=ca.vertcat(self.v, vdot),
            residual=Rows.join(
                Rows.make(balance, equations, choices.FORCE_SIZE),
                self._rows(acceleration, contact.rigid, still, choices.FORCE_SIZE),
                Rows.make(force[soft] - law, laws, choices.FORCE_SIZE),
            ),
            path=self._path(contact, force, position),
            end=self._touch_down(contact.touched_down(following), position, velocity, acceleration),
            fixed_at_end=self._fixed_at_end(contact, following),
            integrands=self._integrands(contact, z, position, velocity),
            frozen=frozen,
        )

    def _point_motion(self, vdot: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Return positions, velocities and accelerations of the contacts, (8,) each."""
        body, theta, q, v = self.walker.rigid_body, self._theta, self.q, self.v
        return (
            body.point_positions(q, theta),
            body.point_velocities(q, v, theta),
            body.point_accelerations(q, v, vdot, theta),
        )

    def _ground_forces(self, position: ca.SX, velocity: ca.SX) -> ca.SX:
        """Return the forces on places that give way, in the order of the pattern [N]."""
        constants = self.constants
        known = {**constants.numbers, **self._free}, constants.weight, constants.friction
        at, moved = ca.vertsplit(position), ca.vertsplit(velocity)
        forces = (
            ground_force(place, at[2 * i + 1], (moved[2 * i], moved[2 * i + 1]), *known)
            for i, place in enumerate(self.pattern.points)
            if place in self.pattern.yielding
        )
        return ca.vertcat(ca.SX(0, 1), *(component for pair in forces for component in pair))

    def _integrands(
        self,
        contact: ContactPhase,
        z: Variables,
        position: ca.SX,
        velocity: ca.SX,
    ) -> ca.SX:
        a, rate, size = self.activations.symbol, self.rates.symbol, self.walker.skeleton.size
        parts = [0, size, size + len(contact.forces), z.size]
        vdot, force, reserve = ca.vertsplit(z.symbol, parts)
        _, force_rate, _ = ca.vertsplit(z.rate, parts)
        columns = (self.q, self.v, a, force, rate, excitation_from_rate(rate, a), vdot, reserve)
        air = self.pattern.in_the_air(contact)
        heights, speeds = position[[2 * i + 1 for i in air]], velocity[[2 * i for i in air]]
        known = *columns, self.reference, heights, speeds, self._cuffs(), force_rate
        *split, slopes = (ca.vertsplit(x) if x.numel() else [] for x in known)
        names = self.walker.skeleton.coordinates
        point = Instant(contact, *split, force_rate=slopes, coordinates=names)
        numbers = ca.vertsplit(self.constants.cost_numbers)
        return ca.vertcat(*self.costs.integrands(point, numbers))

    def _cuffs(self) -> ca.SX:
        """Return the forces of the cuffs on the legs, see `Instant.cuffs` [N]."""
        walker, loads = self.walker, ca.SX.zeros(2 * len(SIDES))
        numbers = {**self.constants.numbers, **self._free}
        state = walker.state(*map(ca.vertsplit, (self.q, self.v, self.activations.symbol)))
        torques = {
            side: self._torques[0][walker.columns([element])[0]]
            for side, element in walker.device.elements.items()
        }
        for side, load in walker.device.cuff_forces(state, numbers, torques).items():
            loads[2 * SIDES.index(side) : 2 * SIDES.index(side) + 2] = ca.vertcat(*load)
        return loads

    def _sample(self) -> ca.SX:
        """Return the cost of one recorded instant of a passage."""
        if not self.costs.passage:
            return ca.SX(0)
        recorded = slice(len(COORDINATES))
        return self._weights["fit"] * ca.sumsqr((self.q - self.reference)[recorded])

    @property
    def _weights(self) -> dict[str, ca.SX]:
        return dict(zip(self.costs.weighed, ca.vertsplit(self.constants.weights), strict=True))

    def _path(self, contact: ContactPhase, force: ca.SX, position: ca.SX) -> Rows:
        """Return heights of the points in the air and the friction cones of the loaded feet.

        What gives way needs neither: its force says both.
        """
        if contact.compliant:
            return Rows()
        places = [self.pattern.points[i] for i in self.pattern.in_the_air(contact)]
        airborne = [ContactForce(place, "z") for place in places]
        height = "{0.point.name} height"
        rows = [self._rows(position, airborne, height, choices.HEIGHT_SIZE, INFINITY)]
        for side in sorted(contact.feet):
            parts = [(f, force[contact.forces.index(f)]) for f in contact.rigid]
            parts = [(f, value) for f, value in parts if f.point.side == side]
            normal = sum(value for f, value in parts if f.bears)
            tangent = sum(value for f, value in parts if not f.bears)
            cone = self.constants.friction * normal
            value = ca.vertcat(cone - tangent, cone + tangent)
            names = _friction_names(side)
            rows.append(Rows.make(value, names, choices.CONTACT_FORCE_SIZE, 0.0, INFINITY))
        return Rows.join(*rows)

    def _touch_down(
        self,
        directions: Sequence[ContactForce],
        position: ca.SX,
        velocity: ca.SX,
        acceleration: ca.SX,
    ) -> Rows:
        """Return the rows that let new points meet the ground without impact and without force.

        Zero acceleration of a new point just before contact is the same as zero force just after.
        """
        upward = [f for f in directions if f.bears]
        return Rows.join(
            self._rows(position, upward, "{0.point.name} touch-down", choices.HEIGHT_SIZE),
            self._rows(velocity, directions, "{0.name} touch-down velocity"),
            self._rows(acceleration, directions, "{0.name} touch-down force", choices.FORCE_SIZE),
        )

    @staticmethod
    def _fixed_at_end(contact: ContactPhase, following: ContactPhase) -> tuple[str, ...]:
        """Return the path rows that touch-down or lift-off already fix at the end of a phase."""
        landing = dict.fromkeys(f.point.name for f in contact.touched_down(following))
        leaving = [side for side in contact.feet if side not in following.feet]
        return (
            *(f"{point} height" for point in landing),
            *(name for side in leaving for name in _friction_names(side)),
        )

    def _excitation_rows(self) -> Rows:
        """Return 0 <= e <= 1 as two linear rows in activation and rate."""
        a, rate = self.activations.symbol, self.rates.symbol
        above, below = (
            tuple(f"{name} excitation {word}" for name in GENERATORS)
            for word in ("above 0", "below 1")
        )
        return Rows.join(
            Rows.make(DEACTIVATION_TIME * rate + a, above, 1.0, 0.0, INFINITY),
            Rows.make(ACTIVATION_TIME * rate + a, below, 1.0, -INFINITY, 1.0),
        )

    def _boundary(self) -> Boundary:
        return gait_boundary(
            (self.states, self.activations, self.rates),
            self.parameters,
            self.costs,
            self._weights,
            self.phases,
            self.form == "step",
            self._standing() if self.form == "passage" else None,
        )

    def _standing(self) -> Rows:
        """Return the rows that let the first phase begin on the ground and at rest there."""
        forces = self.phases[0].forces
        position, velocity, _ = self._point_motion(ca.SX.zeros(self.walker.skeleton.size))
        upward = [f for f in forces if f.bears]
        return Rows.join(
            self._rows(position, upward, "{0.point.name} height at the start", choices.HEIGHT_SIZE),
            self._rows(velocity, forces, "{0.name} velocity at the start"),
        )

    def _of(self, values: ca.SX, forces: Sequence[ContactForce]) -> ca.SX:
        """Return the rows, among those of all forces, of some of them."""
        return values[[self.pattern.forces.index(force) for force in forces], :]

    def _rows(
        self,
        values: ca.SX,
        forces: Sequence[ContactForce],
        name: str,
        scale: float = 1.0,
        upper: float = 0.0,
    ) -> Rows:
        """Return rows in the directions of some forces; `name` is filled in with each."""
        names = tuple(name.format(force) for force in forces)
        return Rows.make(self._of(values, forces), names, scale, 0.0, upper)


def algebraic_names(skeleton: Skeleton, contact: ContactPhase) -> tuple[str, ...]:
    """Return the names of the algebraic variables of a phase in order."""
    return skeleton.named("acceleration") + contact.force_names + skeleton.named("reserve")


def _friction_names(side: Side) -> tuple[str, str]:
    foot = f"foot_{SUFFIX[side]}"
    return f"{foot} forward friction", f"{foot} backward friction"


def gait_blocks(gait: GaitProblem, degree: int) -> CollocationBlocks:
    """Return the collocation blocks of a gait problem with so many Radau points in an interval.

    All that a patient or a config brings in is a number of the problem: problems of equal structure
    share their blocks and all derivatives, which are built once in a process.
    """
    key = (gait.structure, degree)
    if key not in _BUILT:
        kept = kept_tapes(key, _MAKERS) if kernels() is not None and gait.shipped else None
        _BUILT[key] = CollocationBlocks(gait.build(), degree, kept)
        if kept is None and gait.shipped:
            _keep(_BUILT[key], key)
    return _BUILT[key]


def _keep(blocks: CollocationBlocks, key: Hashable) -> None:
    """Keep the tapes of blocks for other processes, if there are tapes and a place for them."""
    if kernels() is None or cache_folder() is None:
        return
    derived = [block for block in blocks.blocks if block.matters]
    tapes = {b.name: (b.rows, b.tapes) for b in derived if b.tapes is not None}
    if len(tapes) == len(derived):
        keep_tapes(key, tapes, _MAKERS)
