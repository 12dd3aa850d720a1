"""The walker: one patient's rigid bodies, muscle torque generators, orthosis and ground contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import (
    CONDITIONS,
    CONTACT_FORCES,
    CONTACT_POINTS,
    COORDINATES,
    ROOT,
    SIDES,
    SUFFIX,
    Condition,
)
from pathwalker_cli.errors import InputError
from pathwalker_cli.model.backends import RigidBodyFunctions, rigid_body_functions
from pathwalker_cli.model.contact import ContactPhase, phase_named
from pathwalker_cli.model.muscle import MuscleTorqueGenerator, generators
from pathwalker_cli.model.orthosis import OrthosisSide, orthosis_torque
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient

__all__ = ["ANKLES", "GENERATOR_ROWS", "Walker", "build_walker"]

ANKLES: Final = tuple(COORDINATES.index(f"ankle_{SUFFIX[side]}") for side in SIDES)
"""Positions of the right and the left ankle among the coordinates."""

_GENERATORS: Final = generators()
GENERATOR_ROWS: Final = tuple(COORDINATES.index(g.coordinate) for g in _GENERATORS)
"""Position of the coordinate that each generator drives."""


@dataclass(frozen=True)
class Walker:
    """A patient's walking model in one condition.

    Args:
        patient: The patient.
        condition: "barefoot" or "orthosis".
        model: Rigid bodies in Pinocchio; its q is `conventions.COORDINATES`.
        rigid_body: The same as CasADi functions.
        max_isometric_torque: Strengths in the order of `conventions.GENERATORS` [N m], (14,).
        orthosis: Fixed orthosis parameters right and left; None when barefoot.
    """

    patient: Patient
    condition: Condition
    model: pin.Model
    rigid_body: RigidBodyFunctions
    max_isometric_torque: np.ndarray
    orthosis: tuple[OrthosisSide, OrthosisSide] | None

    @property
    def backend(self) -> str:
        """Name of the dynamics back end at work."""
        return self.rigid_body.backend

    @property
    def generators(self) -> tuple[MuscleTorqueGenerator, ...]:
        """The 14 muscle torque generators."""
        return _GENERATORS

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
        data = self.model.createData()
        zero = np.zeros(self.model.nq)
        pin.forwardKinematics(self.model, data, zero)
        hip = np.mean([data.oMi[self.model.getJointId(f"hip_{s}")].translation[2] for s in "rl"])
        return float(hip - self.contact_points(zero)[:, 1].mean())

    def muscle_torques(self, q: Any, v: Any, activation: Any) -> np.ndarray:
        """Return the signed joint torque of each generator, equation (1).

        Args:
            q: Generalised coordinates [m, rad], shape (10,).
            v: Generalised velocities [m/s, rad/s], shape (10,).
            activation: Activations in [0, 1], shape (14,).

        Returns:
            Torques [N m] in the order of `conventions.GENERATORS`, shape (14,).
        """
        q, v = _vector(q, 10, "q"), _vector(v, 10, "v")
        activation = _vector(activation, 14, "activation")
        return np.array(
            [
                float(g.torque(q[row], v[row], activation[i], self.max_isometric_torque[i]))
                for i, (g, row) in enumerate(zip(_GENERATORS, GENERATOR_ROWS, strict=True))
            ]
        )

    def orthosis_torques(self, q: Any, k_d: Any, k_p: Any) -> np.ndarray:
        """Return the torques of the orthoses on the ankles.

        Args:
            q: Generalised coordinates [m, rad], shape (10,).
            k_d: Dorsiflexion stiffness right, left [N m/rad], shape (2,) or one for both.
            k_p: Plantarflexion stiffness right, left [N m/rad], shape (2,) or one for both.

        Returns:
            Torques right, left [N m], + = plantarflexion, shape (2,); zero when barefoot.
        """
        q = _vector(q, 10, "q")
        if self.orthosis is None:
            return np.zeros(2)
        k_d, k_p = np.broadcast_to(k_d, 2), np.broadcast_to(k_p, 2)
        sides = zip(self.orthosis, ANKLES, k_d, k_p, strict=True)
        return np.array([float(orthosis_torque(s, q[row], d, p)) for s, row, d, p in sides])

    def joint_torques(self, muscle: Any, orthosis: Any = (0.0, 0.0)) -> np.ndarray:
        """Return generalised forces of the actuators [N m], shape (10,); zero at the root.

        Args:
            muscle: Torque of each generator [N m], shape (14,).
            orthosis: Torque of the orthoses right, left [N m], shape (2,).
        """
        tau = np.zeros(len(COORDINATES))
        np.add.at(tau, list(GENERATOR_ROWS), _vector(muscle, 14, "muscle"))
        np.add.at(tau, list(ANKLES), _vector(orthosis, 2, "orthosis"))
        return tau

    def contact_dynamics(
        self, phase: str | int | ContactPhase, q: Any, v: Any, tau: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return accelerations and ground reaction forces while some points cannot move.

        Solves M vdot + h = tau + J' f, J vdot + dJ/dt v = 0 for the directions of the phase.

        Args:
            phase: A contact phase, its name or its number.
            q: Generalised coordinates [m, rad], shape (10,).
            v: Generalised velocities [m/s, rad/s], shape (10,).
            tau: Generalised forces [N, N m], shape (10,), or joint torques only, shape (7,).

        Returns:
            vdot [m/s^2, rad/s^2], shape (10,), and forces on the body [N] in the order of
            `conventions.CONTACT_FORCES`, shape (8,); zero where there is no contact.
        """
        q, v, tau = _vector(q, 10, "q"), _vector(v, 10, "v"), np.asarray(tau, float).ravel()
        if tau.size == len(COORDINATES) - len(ROOT):
            tau = np.concatenate([np.zeros(len(ROOT)), tau])
        tau = _vector(tau, 10, "tau")
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

        Args:
            phase: The contact phase of all instants.
            q: Generalised coordinates [m, rad], shape (m, 10).
            v: Generalised velocities [m/s, rad/s], shape (m, 10).
            tau: Generalised forces [N, N m], shape (m, 10).
            terms: What evaluates `dynamics_terms` at m points, if not the function itself.
        """
        active = list((phase if isinstance(phase, ContactPhase) else phase_named(phase)).indices)
        count, n, size = len(q), len(COORDINATES), len(active)
        mass, bias, jacobian, drift = map(np.asarray, (terms or self.dynamics_terms)(q.T, v.T))
        # of m instants CasADi sets the matrices side by side
        jacobian = jacobian.reshape(-1, count, n)[active].swapaxes(0, 1)
        matrix = np.zeros((count, n + size, n + size))
        matrix[:, :n, :n] = mass.reshape(n, count, n).swapaxes(0, 1)
        matrix[:, n:, :n] = jacobian
        matrix[:, :n, n:] = -jacobian.swapaxes(1, 2)
        right = np.hstack([tau - bias.T, -drift[active].T])[..., None]
        solution = np.linalg.solve(matrix, right)[..., 0]
        forces = np.zeros((count, len(CONTACT_FORCES)))
        forces[:, active] = solution[:, n:]
        return solution[:, :n], forces

    def contact_points(self, q: Any) -> np.ndarray:
        """Return right heel, right toe, left heel, left toe: x and z [m], shape (4, 2)."""
        q = _vector(q, 10, "q")
        return np.asarray(self.rigid_body.point_positions(q, self.rigid_body.parameters)).reshape(
            4, 2
        )

    @cached_property
    def dynamics_terms(self) -> ca.Function:
        """Function (q, v) -> mass matrix, bias, point Jacobian, point acceleration at vdot = 0."""
        body, theta = self.rigid_body, self.rigid_body.parameters
        q, v = ca.SX.sym("q", body.nq), ca.SX.sym("v", body.nq)
        outputs = [
            ca.densify(body.mass_matrix(q, theta)),
            ca.densify(body.bias(q, v, theta)),
            ca.densify(body.point_jacobian(q, theta)),
            ca.densify(body.point_accelerations(q, v, ca.SX.zeros(body.nq), theta)),
        ]
        return ca.Function("dynamics", [q, v], outputs)


def _vector(values: Any, size: int, name: str) -> np.ndarray:
    """Return a finite vector of this size.

    Raises:
        InputError: If it has another size or entries that are not finite.
    """
    vector = np.asarray(values, dtype=float).ravel()
    if vector.size != size or not np.all(np.isfinite(vector)):
        raise InputError(
            f"{name} has {vector.size} entries"
            if vector.size != size
            else f"{name} has entries that are not finite",
            allowed=f"{size} finite numbers",
        )
    return vector


def build_walker(
    patient: Patient,
    condition: Condition = "barefoot",
    published: bool = False,
    backend: str = "auto",
) -> Walker:
    """Return the walking model of a patient.

    Args:
        patient: The patient.
        condition: "barefoot" or "orthosis".
        published: Reproduce the quirks of the published model (right forearm).
        backend: Dynamics back end, see `model.backends`.

    Raises:
        InputError: If the condition does not exist.
        PatientError: If the patient lacks strengths or, for "orthosis", an orthosis.
    """
    if condition not in CONDITIONS:
        raise InputError(
            f"there is no condition {condition!r}", allowed=" or ".join(map(repr, CONDITIONS))
        )
    model = pinocchio_model(patient, condition, published)
    strengths = np.array(patient.max_isometric_torque)
    strengths.setflags(write=False)
    orthosis = _orthosis_sides(patient) if condition == "orthosis" else None
    functions = rigid_body_functions(model, CONTACT_POINTS, backend)
    return Walker(patient, condition, model, functions, strengths, orthosis)


def _orthosis_sides(patient: Patient) -> tuple[OrthosisSide, OrthosisSide]:
    data = patient.require_orthosis()
    right, left = (
        OrthosisSide(
            neutral_angle=data.neutral_angle,
            free_play=data.free_play,
            preload_torque=data.preload_torque,
            dorsiflexion_stop=data.dorsiflexion_stop[side],
            plantarflexion_stop=data.plantarflexion_stop[side],
            dorsiflexion_stop_stiffness=data.stop_stiffness.dorsiflexion,
            plantarflexion_stop_stiffness=data.stop_stiffness.plantarflexion,
        )
        for side in SIDES
    )
    return right, left
