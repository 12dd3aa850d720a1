"""Conservation laws of a solved gait: work against mechanical energy, forces against momentum.

Numeric Pinocchio supplies energy and momentum of poses and speeds; work and impulse are integrals
of what the solution says of torques and ground forces.  Neither needs the equations of motion, so
an error in them, in signs or in contact Jacobians shows here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from pathwalker_cli.stride.ground import touched
from pathwalker_cli.stride.series import GaitSeries


@dataclass(frozen=True)
class Balance:
    """Balances over one stride; differences are the largest at the end of any mesh interval.

    Args:
        muscle_work: Net work of all muscles [J].
        orthosis_work: Net work of both orthoses [J]; 0 but for the ends of an aperiodic stride.
        contact_work: Work of the ground on the body, all amounts added up [J]; 0 without slip.
        ground_loss: Net work of the body on the ground [J]: what soles that give way take up.
        energy_change: Mechanical energy at the end less that at the beginning [J].
        energy: Largest difference of work done and energy gained since the beginning [J].
        work_scale: Work that muscles did and took up, all amounts added up [J].
        impulse: Largest difference of the impulse of all forces and the momentum gained, forward
            and up [N s].
        impulse_scale: Body weight times stride time [N s].
        angular_impulse: The same about the origin of the start of the stride [N m s].
        angular_scale: Body weight times stride time times distance [N m s].
    """

    muscle_work: float
    orthosis_work: float
    contact_work: float
    ground_loss: float
    energy_change: float
    energy: float
    work_scale: float
    impulse: float
    impulse_scale: float
    angular_impulse: float
    angular_scale: float


def balance(series: GaitSeries) -> Balance:
    """Return the balances of a stride."""
    walker, rows = series.walker, _node_rows(series)
    weights = series.quadrature
    data = walker.model.createData()
    states = [_State.of(series, k, data) for k in range(len(series.time))]
    energy = np.array([state.energy for state in states])
    momentum = np.array([state.momentum for state in states])
    powers = series.element_power
    muscles = powers[:, walker.columns((*walker.muscles, *walker.tissue))]
    orthosis = powers[:, walker.columns(walker.device.forces)].sum(axis=1)
    contact = np.array([state.contact_power for state in states])
    work = np.cumsum(weights * (muscles.sum(axis=1) + orthosis + contact))
    gained = energy - energy[0]
    forces = np.array([state.force_and_moment for state in states])
    impulse = np.cumsum(weights[:, None] * forces, axis=0)
    missed = np.abs(impulse - (momentum - momentum[0]))[rows].max(axis=0)
    load = walker.weight * series.duration
    return Balance(
        muscle_work=float(weights @ muscles.sum(axis=1)),
        orthosis_work=float(weights @ orthosis),
        contact_work=float(weights @ np.abs(contact)),
        ground_loss=-float(weights @ contact),
        energy_change=float(gained[-1]),
        energy=float(np.abs(work - gained)[rows].max()),
        work_scale=float(weights @ np.abs(muscles).sum(axis=1)),
        impulse=float(missed[:2].max()),
        impulse_scale=load,
        angular_impulse=float(missed[2]),
        angular_scale=load * series.distance,
    )


def _node_rows(series: GaitSeries) -> np.ndarray:
    """Return the instants at the ends of mesh intervals, first instant included."""
    rows, at = [0], 0
    for phase in series.motion.phases:
        rows += [at + (i + 1) * phase.degree for i in range(phase.intervals)]
        at += phase.intervals * phase.degree
    return np.array(rows)


@dataclass(frozen=True)
class _State:
    """Energy, momentum and forces at one instant.

    Args:
        energy: Mechanical energy [J].
        momentum: Linear momentum forward and up [N s], angular momentum about the origin [N m s].
        force_and_moment: Rate of the momentum by gravity and ground [N, N, N m].
        contact_power: Power of the ground forces [W].
    """

    energy: float
    momentum: np.ndarray
    force_and_moment: np.ndarray
    contact_power: float

    @staticmethod
    def of(series: GaitSeries, k: int, data: pin.Data) -> _State:
        """Return the state of an instant; `data` is where Pinocchio computes."""
        model = series.walker.model
        q, v = np.array(series.q[k]), np.array(series.v[k])
        energy = pin.computeKineticEnergy(model, data, q, v)
        energy += pin.computePotentialEnergy(model, data, q)
        centroidal = pin.computeCentroidalMomentum(model, data, q, v)
        centre = np.array(data.com[0])
        linear, mass = np.array(centroidal.linear), float(pin.computeTotalMass(model))
        origin = np.array([series.q[0, 0], 0.0, 0.0])
        angular = np.array(centroidal.angular) + np.cross(centre - origin, linear)
        weight = mass * np.array(model.gravity.linear)
        force, moment, power = weight.copy(), np.cross(centre - origin, weight), 0.0
        pin.forwardKinematics(model, data, q, v)
        pin.updateFramePlacements(model, data)
        ground = series.force[k].reshape(-1, 2)
        for place, (fx, fz) in zip(touched(series.walker, data), ground, strict=True):
            motion = pin.getFrameVelocity(model, data, place.frame, pin.LOCAL_WORLD_ALIGNED)
            speed = motion.linear + np.cross(motion.angular, place.arm)
            load = np.array([fx, 0.0, fz])
            force += load
            moment += np.cross(place.position - origin, load)
            power += float(load @ np.array(speed))
        return _State(
            energy=float(energy),
            momentum=np.array([linear[0], linear[2], angular[1]]),
            force_and_moment=np.array([force[0], force[2], moment[1]]),
            contact_power=power,
        )
