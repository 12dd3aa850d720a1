"""The walker: one patient's skeleton, force elements, contacts, and the numbers of all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import CONDITIONS, SIDES, STIFFNESSES, Condition
from pathwalker_cli.errors import InputError
from pathwalker_cli.model.backends import rigid_body_functions
from pathwalker_cli.model.backends.functions import RigidBodyFunctions
from pathwalker_cli.model.choices import FRICTION
from pathwalker_cli.model.compliance import ground_force
from pathwalker_cli.model.contact import (
    HEEL_TOE,
    POINTS,
    Contact,
    ContactPattern,
    ContactPhase,
    Feet,
)
from pathwalker_cli.model.devices import Device
from pathwalker_cli.model.elements import ForceElement, State, element_forces, generalised_forces
from pathwalker_cli.model.elements.muscle import MuscleTorqueGenerator
from pathwalker_cli.model.elements.orthosis import OrthosisSide
from pathwalker_cli.model.numbers import Number, Unknown
from pathwalker_cli.model.parts import Parts
from pathwalker_cli.model.skeleton import Build, Side, Skeleton
from pathwalker_cli.model.urdf import frame_positions, pinocchio_model
from pathwalker_cli.patient import Patient


@dataclass(frozen=True)
class Walker:
    """A patient's walking model in one condition.

    Args:
        parts: What it is made of.
        model: Rigid bodies in Pinocchio.
        rigid_body: The same as CasADi functions.
        values: Every named number by address [SI].
        unknowns: The numbers that a problem is free to choose.
        published: Whether it reproduces the quirks of the published model.
        friction: Coefficient of friction of soles that give way.
    """

    patient: Patient
    parts: Parts
    model: pin.Model
    rigid_body: RigidBodyFunctions
    values: Mapping[str, float]
    unknowns: tuple[Unknown, ...] = ()
    published: bool = False
    friction: float = FRICTION

    def __repr__(self) -> str:
        """Return who walks, and with what."""
        return f"Walker({self.patient.id!r}, {self.condition!r}, {self.total_mass:.1f} kg)"

    @property
    def skeleton(self) -> Skeleton:
        """Bodies and joints: names and order of the coordinates."""
        return self.parts.skeleton

    @property
    def backend(self) -> str:
        """Name of the dynamics back end at work."""
        return self.rigid_body.backend

    @property
    def condition(self) -> Condition:
        """Its condition, "barefoot" or "orthosis"."""
        return self.parts.condition

    @property
    def muscles(self) -> tuple[MuscleTorqueGenerator, ...]:
        """The muscle torque generators."""
        return self.parts.muscles

    @property
    def tissue(self) -> tuple[ForceElement, ...]:
        """Force elements of the body beside the muscles."""
        return self.parts.passive

    @property
    def device(self) -> Device:
        """What the patient walks with."""
        return self.parts.device

    @property
    def shelled(self) -> tuple[Side, ...]:
        """Sides whose orthosis is a body of its own."""
        return self.parts.shelled

    @property
    def elements(self) -> tuple[ForceElement, ...]:
        """All force elements: muscles, other tissue, then what the device adds."""
        return self.parts.elements

    def columns(self, elements: Iterable[ForceElement]) -> list[int]:
        """Return where the forces of some elements stand among those of all."""
        names = {element.name for element in elements}
        owners = [element.name for element in self.elements for _ in element.coordinates]
        return [i for i, owner in enumerate(owners) if owner in names]

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Every named number: of the elements, then of the bodies."""
        return self.parts.numbers

    @property
    def pattern(self) -> ContactPattern:
        """The order in which places of the feet stand on the ground."""
        return self.parts.pattern

    @property
    def shapes(self) -> list[float]:
        """Values of `Parts.shapes`: radii [m], then roundnesses [-]."""
        return [self.values[number.address] for number in self.parts.shapes]

    @property
    def max_isometric_torque(self) -> np.ndarray:
        """Strengths in the order of `conventions.GENERATORS` [N m], (14,)."""
        return np.array([self.values[m.numbers[0].address] for m in self.muscles])

    @property
    def orthosis(self) -> dict[Side, OrthosisSide]:
        """All but the springs of the orthoses, by the side that wears one."""
        return {side: each.fixed(self.values) for side, each in self.device.elements.items()}

    @property
    def springs(self) -> tuple[str, ...]:
        """Names of the springs that are worn, in the order of `conventions.STIFFNESSES`."""
        return tuple(n for n in STIFFNESSES if n.rpartition("_")[2] in self.device.elements)

    @property
    def stiffness(self) -> np.ndarray:
        """K_D right, left, K_P right, left [N m/rad], shape (4,); empty when barefoot.

        NaN where the one side wears an orthosis and the other one none.
        """
        if not self.device.worn:
            return np.zeros(0)
        springs = {side: each.springs(self.values) for side, each in self.device.elements.items()}
        return np.array([springs.get(side, (np.nan, np.nan)) for side in SIDES]).T.ravel()

    def with_parameters(self, parameters: Sequence[float] | np.ndarray) -> Walker:
        """Return the walker in which the unknowns have these values [SI], in their order."""
        pairs = zip(self.unknowns, parameters, strict=True)
        return self.with_values({a: float(x) for unknown, x in pairs for a in unknown.addresses})

    def with_values(self, values: Mapping[str, float]) -> Walker:
        """Return the walker with other numbers, by address [SI]."""
        values = {**self.values, **values}
        changed = replace(self, values=values)
        bodies = [n.address for n in self.parts.body_numbers]
        if all(values[address] == self.values[address] for address in bodies):
            return changed
        model = pinocchio_model(self.patient, self.condition, self.published, values, self.skeleton)
        parameters = self.rigid_body.parameters_for(model, changed.shapes)
        return replace(
            changed, model=model, rigid_body=replace(self.rigid_body, parameters=parameters)
        )

    @cached_property
    def as_recorded(self) -> Walker:
        """The walker as recordings know it: feet in one piece, an orthosis glued to the leg."""
        parts = replace(self.parts, toes=False, orthosis="glued")
        if parts.skeleton == self.skeleton:
            return self
        walker = walker_of(self.patient, parts, self.published, self.backend)
        return walker.with_values({n.address: self.values[n.address] for n in parts.numbers})

    @property
    def total_mass(self) -> float:
        """Mass of body and orthosis [kg]."""
        return float(pin.computeTotalMass(self.model))

    @property
    def weight(self) -> float:
        """Body weight including the orthosis [N]."""
        return self.total_mass * float(np.linalg.norm(self.model.gravity.linear))

    @cached_property
    def leg_length(self) -> float:
        """Mean distance from hip to sole in the zero pose [m]."""
        data, zero = self.model.createData(), np.zeros(self.model.nq)
        pin.forwardKinematics(self.model, data, zero)
        hip = np.mean([data.oMi[self.model.getJointId(f"hip_{s}")].translation[2] for s in "rl"])
        return float(hip - self.foot_points(zero)[:, 1].mean())

    def body_slopes(self, number: Number) -> np.ndarray:
        """Return the derivatives of the rigid bodies' numbers in one of `Parts.body_numbers`, (k,).

        They are exact: masses, moments of inertia and radii are linear in it.
        """
        moved = self.with_values({number.address: self.values[number.address] + 1.0})
        return moved.rigid_body.parameters - self.rigid_body.parameters

    def state(self, q: Any, v: Any, activation: Any) -> State:
        """Return coordinates, velocities and activations by name; one entry or row for each."""
        names, muscles = self.skeleton.coordinates, (muscle.name for muscle in self.muscles)
        pairs = ((names, q), (names, v), (muscles, activation))
        return State(*(dict(zip(keys, values, strict=True)) for keys, values in pairs))

    def element_forces(self, q: np.ndarray, v: np.ndarray, activation: np.ndarray) -> np.ndarray:
        """Return the forces of all elements in order at m instants [N m], shape (m, k).

        q [m, rad] and v [m/s, rad/s] are of shape (m, 10), activations in [0, 1] of shape (m, 14).
        """
        state = self.state(np.transpose(q), np.transpose(v), np.transpose(activation))
        return np.stack(element_forces(self.elements, state, self.values), axis=-1)

    def generalised_forces(self, forces: np.ndarray) -> np.ndarray:
        """Return the sum of element forces (m, k) on every coordinate [N, N m], shape (m, 10)."""
        columns = list(np.moveaxis(np.asarray(forces, float), -1, 0))
        zero = np.zeros(np.shape(forces)[:-1])
        names = self.skeleton.coordinates
        return np.stack(generalised_forces(self.elements, columns, names, zero), axis=-1)

    @cached_property
    def force_function(self) -> ca.Function:
        """Function (q, v, activation) -> forces of all elements (k,), generalised forces (10,)."""
        n, m = self.skeleton.size, len(self.muscles)
        q, v, a = (ca.SX.sym(name, size) for name, size in (("q", n), ("v", n), ("a", m)))
        state = self.state(*(ca.vertsplit(x) for x in (q, v, a)))
        forces = element_forces(self.elements, state, self.values)
        total = generalised_forces(self.elements, forces, self.skeleton.coordinates, ca.SX(0))
        return ca.Function("forces", [q, v, a], [ca.vertcat(*forces), ca.vertcat(*total)])

    def muscle_torques(self, q: Any, v: Any, activation: Any) -> np.ndarray:
        """Return the signed joint torque of each generator, equation (1).

        Args:
            q: Generalised coordinates [m, rad], shape (10,).
            v: Generalised velocities [m/s, rad/s], shape (10,).
            activation: Activations in [0, 1], shape (14,).

        Returns:
            Torques [N m] in the order of `conventions.GENERATORS`, shape (14,).
        """
        q, v = (_vector(values, self.skeleton.size, name) for values, name in ((q, "q"), (v, "v")))
        activation = _vector(activation, len(self.muscles), "activation")
        return self.element_forces(q, v, activation)[self.columns(self.muscles)]

    def orthosis_torques(self, q: Any, k_d: Any, k_p: Any) -> np.ndarray:
        """Return the torques of the orthoses on ankles, or hinges of their own.

        Args:
            q: Generalised coordinates [m, rad], shape (10,).
            k_d: Dorsiflexion stiffness right, left [N m/rad], shape (2,) or one for both.
            k_p: Plantarflexion stiffness right, left [N m/rad], shape (2,) or one for both.

        Returns:
            Torques right, left [N m], + = plantarflexion, shape (2,); zero where none is worn.
        """
        q, rest = _vector(q, self.skeleton.size, "q"), np.zeros(self.skeleton.size)
        given = {"dorsiflexion_stiffness": k_d, "plantarflexion_stiffness": k_p}
        springs = {
            number.address: float(np.broadcast_to(given[number.name], 2)[SIDES.index(side)])
            for side, element in self.device.elements.items()
            for number in element.numbers
            if number.name in given
        }
        forces = self.with_values(springs).element_forces(q, rest, np.zeros(len(self.muscles)))
        return self.device_torques(forces)

    def device_torques(self, forces: np.ndarray) -> np.ndarray:
        """Return what orthoses exert right, left [N m], (..., 2), of the forces of all elements.

        These are of shape (..., k); a side that wears none has zero.
        """
        torques = np.zeros((*forces.shape[:-1], len(SIDES)))
        worn = [SIDES.index(side) for side in self.device.elements]
        torques[..., worn] = forces[..., self.columns(self.device.elements.values())]
        return torques

    def cuff_forces(self, q: np.ndarray, v: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return what the cuffs do to the legs at m instants, across and along the shank [N].

        q [m, rad], v [m/s, rad/s] and the forces of all elements have m rows; right across, right
        along, left across, left along have a column each, (m, 4): 0 where no orthosis is worn.
        """
        torques = dict(zip(SIDES, self.device_torques(forces).T, strict=True))
        state, loads = self.state(q.T, v.T, [None] * len(self.muscles)), np.zeros((len(q), 4))
        found = self.device.cuff_forces(state, self.values, torques)
        for side, load in found.items():
            loads[:, 2 * SIDES.index(side) : 2 * SIDES.index(side) + 2] = np.stack(load, axis=1)
        return loads

    def joint_torques_of(self, net: np.ndarray) -> np.ndarray:
        """Return net forces (..., n) on all coordinates as the joints of the body feel them.

        What turns beside a joint, as the hinge of an orthosis, counts with it: a laboratory, to
        which leg and shell are one, finds the sum.
        """
        felt, skeleton = np.array(net), self.skeleton
        for joint in skeleton.joints:
            if joint.beside:
                there, here = skeleton.index(joint.beside), skeleton.index(joint.coordinate)
                felt[..., there] += net[..., here]
        return felt

    def joint_torques(self, muscle: Any, orthosis: Any = (0.0, 0.0)) -> np.ndarray:
        """Return generalised forces of the actuators [N m], shape (10,); zero at the root.

        Args:
            muscle: Torque of each generator [N m], shape (14,).
            orthosis: Torque of the orthoses right, left [N m], shape (2,); where none is worn, it
                does not count.
        """
        forces = np.zeros(sum(len(element.coordinates) for element in self.elements))
        forces[self.columns(self.muscles)] = _vector(muscle, len(self.muscles), "muscle")
        worn = [SIDES.index(side) for side in self.device.elements]
        bent = self.columns(self.device.elements.values())
        forces[bent] = _vector(orthosis, 2, "orthosis")[worn]
        return self.generalised_forces(forces)

    def contact_dynamics(
        self, phase: str | int | ContactPhase, q: Any, v: Any, tau: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return accelerations and ground reaction forces while some points cannot move.

        Solves M vdot + h = tau + J' f, J vdot + dJ/dt v = 0 for the directions of the phase; of
        soles that give way, f is their law; see `model.compliance`.

        Args:
            phase: A contact phase, its name or its number.
            q: Generalised coordinates [m, rad], shape (10,).
            v: Generalised velocities [m/s, rad/s], shape (10,).
            tau: Generalised forces [N, N m], shape (10,), or joint torques only, shape (7,).

        Returns:
            vdot [m/s^2, rad/s^2], shape (10,), and forces on the body [N] in the order of
            `pattern.forces`, shape (8,); zero where there is no contact.
        """
        n, root = self.skeleton.size, len(self.skeleton.root)
        q, v, tau = _vector(q, n, "q"), _vector(v, n, "v"), np.asarray(tau, float).ravel()
        if tau.size == n - root:
            tau = np.concatenate([np.zeros(root), tau])
        tau = _vector(tau, n, "tau")
        vdot, forces = self.contact_dynamics_series(phase, q[None], v[None], tau[None])
        return vdot[0], forces[0]

    def contact_dynamics_series(
        self,
        phase: str | int | ContactPhase,
        q: np.ndarray,
        v: np.ndarray,
        tau: np.ndarray,
        terms: Callable[[np.ndarray, np.ndarray], Sequence[Any]] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return `contact_dynamics` of m instants: vdot, shape (m, 10), and forces, shape (m, 8).

        q, v and tau are of shape (m, 10); `terms` evaluates `dynamics_terms` at m points, if not
        the function itself.
        """
        contact = self.pattern.phase(phase)
        held, soft = map(self.pattern.indices, (contact.rigid, contact.yielding))
        count, n, size = len(q), self.skeleton.size, len(held)
        mass, bias, jacobian, drift, places = map(
            np.asarray, (terms or self.dynamics_terms)(q.T, v.T)
        )
        # of m instants CasADi sets the matrices side by side
        jacobian = jacobian.reshape(-1, count, n).swapaxes(0, 1)
        forces, pushed = np.zeros((count, len(self.pattern.forces))), tau - bias.T
        if soft:
            velocity = np.einsum("ijk,ik->ij", jacobian, v)
            forces[:, soft] = self._ground_forces(places.T, velocity)
            pushed = pushed + np.einsum("ij,ijk->ik", forces[:, soft], jacobian[:, soft])
        matrix = np.zeros((count, n + size, n + size))
        matrix[:, :n, :n] = mass.reshape(n, count, n).swapaxes(0, 1)
        matrix[:, n:, :n] = jacobian[:, held]
        matrix[:, :n, n:] = -jacobian[:, held].swapaxes(1, 2)
        right = np.hstack([pushed, -drift[held].T])[..., None]
        solution = np.linalg.solve(matrix, right)[..., 0]
        forces[:, held] = solution[:, n:]
        return solution[:, :n], forces

    def _ground_forces(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the forces on places that give way [N] at m instants, two columns each.

        Of places and velocities of all contacts, (m, 2 k) each [m, m/s].
        """
        known = self.values, self.weight, self.friction
        forces = [
            ground_force(
                place, position[:, 2 * i + 1], (velocity[:, 2 * i], velocity[:, 2 * i + 1]), *known
            )
            for i, place in enumerate(self.pattern.points)
            if place in self.pattern.yielding
        ]
        return np.concatenate(forces).T

    def contact_points(self, q: Any) -> np.ndarray:
        """Return where the places of `pattern.points` touch the ground in q (..., 10), or would.

        Returns:
            Forward and up [m], shape (..., k, 2): right heel, right toe, left heel, left toe; of
            soles right and left.
        """
        q, body = _vectors(q, self.skeleton.size, "q"), self.rigid_body
        places = np.asarray(body.point_positions(q.reshape(-1, q.shape[-1]).T, body.parameters))
        return places.T.reshape(*q.shape[:-1], -1, 2)

    def foot_points(self, q: Any) -> np.ndarray:
        """Return heel and toe, right, then left, of q (..., 10): forward, up [m], (..., 4, 2)."""
        q = _vectors(q, self.skeleton.size, "q")
        return frame_positions(self.model, q, [point.name for point in POINTS])

    def frames(self, q: Any, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Return where frames are in q (..., 10): forward, up [m], (..., 2), by name."""
        places = frame_positions(self.model, _vectors(q, self.skeleton.size, "q"), names)
        return dict(zip(names, np.moveaxis(places, -2, 0), strict=True))

    @cached_property
    def contact_motion(self) -> ca.Function:
        """Function (q, v) -> positions (2 k,) [m] and velocities [m/s] of the pattern's places."""
        body, theta = self.rigid_body, self.rigid_body.parameters
        q, v = ca.SX.sym("q", body.nq), ca.SX.sym("v", body.nq)
        values = body.point_positions(q, theta), body.point_velocities(q, v, theta)
        return ca.Function("contact_motion", [q, v], [ca.densify(x) for x in values])

    @cached_property
    def dynamics_terms(self) -> ca.Function:
        """Function (q, v) -> mass, bias; of contacts Jacobian, acceleration at vdot = 0, place."""
        body, theta = self.rigid_body, self.rigid_body.parameters
        q, v = ca.SX.sym("q", body.nq), ca.SX.sym("v", body.nq)
        still = body.point_accelerations(q, v, ca.SX.zeros(body.nq), theta)
        places = body.point_positions(q, theta)
        terms = body.mass_matrix(q, theta), body.bias(q, v, theta), body.point_jacobian(q, theta)
        return ca.Function("dynamics", [q, v], [ca.densify(x) for x in (*terms, still, places)])


def _vector(values: Any, size: int, name: str) -> np.ndarray:
    """Return a finite vector of this size, or refuse it."""
    return _vectors(np.ravel(values), size, name)


def _vectors(values: Any, size: int, name: str) -> np.ndarray:
    """Return finite vectors of this size (..., size), or refuse them."""
    vectors = np.asarray(values, dtype=float)
    entries = vectors.shape[-1] if vectors.ndim else 1
    if entries == size and np.all(np.isfinite(vectors)):
        return vectors
    what = f"{entries} entries" if entries != size else "entries that are not finite"
    raise InputError(f"{name} has {what}", allowed=f"{size} finite numbers")


def build_walker(
    patient: Patient,
    condition: Condition = "barefoot",
    published: bool = False,
    backend: str = "auto",
    free: Sequence[str] = (),
    tissue: bool = False,
    feet: Feet = "points",
    contact: Contact = HEEL_TOE,
    further: Sequence[str] = (),
    toes: bool = False,
    orthosis: Build = "glued",
) -> Walker:
    """Return the walking model of a patient; see `Parts` and `walker_of`.

    Raises:
        InputError: If the condition does not exist.
        PatientError: If the patient lacks strengths or, for "orthosis", an orthosis.
        ConfigError: If there is no such number.
    """
    if condition not in CONDITIONS:
        raise InputError(
            f"there is no condition {condition!r}", allowed=" or ".join(map(repr, CONDITIONS))
        )
    braced = patient.braced(condition)
    parts = Parts(condition, tissue, feet, contact, tuple(further), braced, toes, orthosis)
    return walker_of(patient, parts, published, backend, free)


def walker_of(
    patient: Patient,
    parts: Parts,
    published: bool = False,
    backend: str = "auto",
    free: Sequence[str] = (),
    friction: float = FRICTION,
) -> Walker:
    """Return the walking model of a patient.

    Args:
        patient: The patient.
        parts: What it is made of.
        published: Reproduce the quirks of the published model (right forearm).
        backend: Dynamics back end, see `model.backends`.
        free: Addresses of numbers that a problem may choose, beside those that it looks for anyway.
        friction: Coefficient of friction of soles that give way.

    Raises:
        PatientError: If the patient lacks strengths or, for "orthosis", an orthosis.
        ConfigError: If there is no such number.
    """
    if parts.condition == "orthosis":
        patient.require_orthosis()
    model = pinocchio_model(patient, parts.condition, published, skeleton=parts.skeleton)
    values = {n.address: n.value_for(patient) for n in parts.numbers}
    frames, shapes = [p.name for p in parts.frames], [values[n.address] for n in parts.shapes]
    return Walker(
        patient=patient,
        parts=parts,
        model=model,
        rigid_body=rigid_body_functions(
            model, frames, backend, shapes, parts.soles, parts.moved_joints
        ),
        values=values,
        unknowns=parts.unknowns(free),
        published=published,
        friction=friction,
    )
