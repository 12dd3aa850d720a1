"""A predicted step by OpenSim Moco, in an environment that has OpenSim: `moco.py FOLDER`.

The folder holds `model.osim` with circles at heels and toes, the motion to begin with,
`guess.sto`, and `problem.json`; `result.json` is written into it.  Needs nothing but OpenSim.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import opensim as osim

ACTIVATION_TIME = 0.03
"""Time constant of activations [s], between ours of rise and decay."""
ACTIVATION = 0.1
"""Of all actuators, to begin with."""
STEP = 1e-4
"""Step of the re-integration [s]."""
CONTACT = {
    "stiffness": 1e6,
    "dissipation": 2.0,
    "static_friction": 0.8,
    "dynamic_friction": 0.8,
    "viscous_friction": 0.5,
    "transition_velocity": 0.2,
}
"""Of rubber on a floor, as gait simulations with OpenSim have them; SI units."""


def members(collection: Any) -> list[Any]:
    """Return the members of one of OpenSim's sets."""
    return [collection.get(i) for i in range(collection.getSize())]


def vector(values: Any) -> Any:
    """Return numbers as OpenSim's vector."""
    return osim.Vector.createFromMat(np.array(values, float))


def mirrored(name: str) -> str:
    """Return the name of the same thing on the other side."""
    return {"_r": name[:-2] + "_l", "_l": name[:-2] + "_r"}.get(name[-2:], name)


def walker(file: str) -> Any:
    """Return the model with activations in its actuators, and with compliant contact."""
    model = osim.ModelProcessor(file).process()
    actuators = [
        (a.getName(), a.get_coordinate(), a.get_optimal_force())
        for a in map(osim.CoordinateActuator.safeDownCast, members(model.getForceSet()))
    ]
    model.updForceSet().clearAndDestroy()
    for name, coordinate, force in actuators:
        actuator = osim.ActivationCoordinateActuator()
        actuator.setName(name)
        actuator.set_coordinate(coordinate)
        actuator.set_optimal_force(force)
        actuator.set_min_control(0.0)
        actuator.set_max_control(1.0)
        actuator.set_activation_time_constant(ACTIVATION_TIME)
        model.addForce(actuator)
    floor, *spheres = members(model.getContactGeometrySet())
    floor = osim.ContactHalfSpace.safeDownCast(floor)
    for sphere in map(osim.ContactSphere.safeDownCast, spheres):
        force = osim.SmoothSphereHalfSpaceForce(f"{sphere.getName()}_contact", sphere, floor)
        for key, value in CONTACT.items():
            getattr(force, f"set_{key}")(value)
        model.addForce(force)
    model.finalizeConnections()
    model.initSystem()
    return model


def step_of(model: Any, given: dict[str, Any]) -> Any:
    """Return the study: one step and its mirror image, least effort per distance."""
    study = osim.MocoStudy()
    problem = study.updProblem()
    problem.setModel(model)
    problem.setTimeBounds(osim.MocoInitialBounds(0.0), osim.MocoFinalBounds(*given["time"]))
    problem.setStateInfoPattern("/jointset/.*/speed", [-20.0, 20.0], [], [])
    problem.setStateInfoPattern("/forceset/.*/activation", [0.0, 1.0], [], [])
    mirror = osim.MocoPeriodicityGoal("mirror_image")

    def pair(one: str, other: str) -> None:
        mirror.addStatePair(osim.MocoPeriodicityGoalPair(one, other))

    paths = {c.getName(): c.getAbsolutePathString() for c in members(model.getCoordinateSet())}
    for name, path in paths.items():
        other = paths[mirrored(name)]
        pair(f"{path}/speed", f"{other}/speed")
        begin = [0.0] if name == "pelvis_tx" else []
        problem.setStateInfo(f"{path}/value", given["ranges"][name], begin)
        if name != "pelvis_tx":
            pair(f"{path}/value", f"{other}/value")
    for force in members(model.getForceSet()):
        if osim.ActivationCoordinateActuator.safeDownCast(force) is not None:
            one, other = (f"/forceset/{n}" for n in (force.getName(), mirrored(force.getName())))
            pair(f"{one}/activation", f"{other}/activation")
            mirror.addControlPair(osim.MocoPeriodicityGoalPair(one, other))
    problem.addGoal(mirror)
    speed = osim.MocoAverageSpeedGoal("speed")
    speed.set_desired_average_speed(given["speed"])
    problem.addGoal(speed)
    effort = osim.MocoControlGoal("effort", 1.0)
    effort.setDivideByDisplacement(True)
    problem.addGoal(effort)
    return study


def set_solver(study: Any, given: dict[str, Any]) -> None:
    """Give the study a solver with its mesh, its tolerances, and the motion to begin with."""
    solver = study.initCasADiSolver()
    solver.set_num_mesh_intervals(given["intervals"])
    for name, tolerance in given["tolerances"].items():
        getattr(solver, f"set_optim_{name}")(tolerance)
    solver.set_optim_max_iterations(given["iterations"])
    solver.set_parallel(0)
    table = osim.TimeSeriesTable("guess.sto")
    instants, guess = np.array(table.getIndependentColumn()), solver.createGuess("bounds")
    rest = np.full(instants.size, ACTIVATION)
    guess.setNumTimes(instants.size)
    guess.setTime(vector(instants))
    for name in guess.getStateNames():
        known = name in table.getColumnLabels()
        values = table.getDependentColumn(name).to_numpy() if known else rest
        guess.setState(name, vector(values))
    for name in guess.getControlNames():
        guess.setControl(name, vector(rest))
    solver.setGuess(guess)


def reintegration_error(model: Any, solution: Any) -> tuple[float, float]:
    """Return how far a fixed-step Runge-Kutta integration misses the next mesh point at most.

    Every mesh interval is integrated anew with the controls that were found, which are linear in
    it: of coordinates [m, rad] and of speeds [m/s, rad/s].
    """
    state, n = model.initSystem(), model.getNumCoordinates()
    nodes = solution.exportToStatesTrajectory(model)
    names = [f"/forceset/{force.getName()}" for force in members(model.getForceSet())]
    driven = [name for name in names if name in solution.getControlNames()]
    controls = np.array([solution.getControlMat(name) for name in driven]).T
    instants = solution.getTimeMat()

    def rate(at: float, y: np.ndarray, control: np.ndarray) -> np.ndarray:
        state.setTime(at)
        state.setY(vector(y))
        model.realizeVelocity(state)
        model.setControls(state, vector(control))
        model.realizeAcceleration(state)
        return np.array(state.getYDot().to_numpy())

    worst = np.zeros(2)
    for i in range(0, len(instants) - 2, 2):  # between two mesh points lies one in the middle
        y = np.array(nodes.get(i).getY().to_numpy())
        span, (first, last) = instants[i + 2] - instants[i], controls[[i, i + 2]]
        steps = int(np.ceil(span / STEP))
        h = span / steps
        for k in range(steps):
            a, b, c = (first + share / steps * (last - first) for share in (k, k + 0.5, k + 1))
            at = instants[i] + k * h
            k1 = rate(at, y, a)
            k2 = rate(at + h / 2, y + h / 2 * k1, b)
            k3 = rate(at + h / 2, y + h / 2 * k2, b)
            k4 = rate(at + h, y + h * k3, c)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        missed = np.abs(y - nodes.get(i + 2).getY().to_numpy())[: 2 * n].reshape(2, n)
        worst = np.maximum(worst, missed.max(axis=1))
    return float(worst[0]), float(worst[1])


def main() -> None:
    """Solve, integrate anew, and write what was found."""
    given = json.loads(Path("problem.json").read_text(encoding="utf-8"))
    model = walker("model.osim")
    study = step_of(model, given)
    set_solver(study, given)
    solution = study.solve()
    status = solution.getStatus()
    solution.unseal()
    solution.write("solution.sto")
    began = time.process_time()
    position, velocity = reintegration_error(model, solution)
    seconds = time.process_time() - began
    result = {
        "status": status,
        "iterations": solution.getNumIterations(),
        "step_time": solution.getFinalTime(),
        "position_error": position,
        "velocity_error": velocity,
        "seconds_reintegration": seconds,
    }
    Path("result.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    os.chdir(sys.argv[1])
    main()
