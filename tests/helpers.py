"""A stride without a solve: the stylised gait as a motion in phases with simple forces."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess
from tempfile import TemporaryFile

import numpy as np
import pinocchio as pin

from pathwalker_cli.cli import main
from pathwalker_cli.conventions import COORDINATES, GENERATORS, Condition
from pathwalker_cli.gait.costs import Costs
from pathwalker_cli.gait.stylised import StylisedGait, stylised_trajectory
from pathwalker_cli.model.contact import PHASES, ContactPhase
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, collocation_times
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.trajectory import Trajectory

ACTIVATION = 0.25
FRICTION = 0.1
INTERVALS, DEGREE = 4, 3
STIFFNESS = np.array([50.0, 60.0, 10.0, 20.0])
GAIT = StylisedGait(walking_speed=0.6, stride_length=0.66)
GUARD = 600
"""Time after which what is waited for will never happen [s]."""


def energy_rate(walker: Walker, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> float:
    """Return the rate of kinetic and potential energy [W] by differences along a motion."""
    data, model, h = walker.model.createData(), walker.model, 1e-5

    def energy(t: float) -> float:
        there, speed = q + t * v + t * t / 2.0 * vdot, v + t * vdot
        kinetic = pin.computeKineticEnergy(model, data, there, speed)
        return float(kinetic + pin.computePotentialEnergy(model, data, there))

    return (energy(h) - energy(-h)) / (2.0 * h)


def called_apart(
    folder: Path, *words: str, prepare: Callable[[], None] = lambda: None
) -> CompletedProcess[str]:
    """Run the command line in a process of its own that need not import anything again.

    Args:
        folder: Where.
        words: What follows `pathwalker`.
        prepare: What that process does first.
    """
    with TemporaryFile() as out, TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            try:
                signal.alarm(GUARD)
                os.chdir(folder)
                os.dup2(out.fileno(), 1)
                os.dup2(err.fileno(), 2)
                sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
                os._exit(_called(words, prepare))
            finally:
                os._exit(1)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        out.seek(0), err.seek(0)
        return CompletedProcess(words, code, out.read().decode(), err.read().decode())


def _called(words: tuple[str, ...], prepare: Callable[[], None]) -> int:
    """Return the exit code that the interpreter would end with."""
    sys.argv = ["pathwalker", *words]
    try:
        prepare()
        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush(), sys.stderr.flush()
    return code


@cache
def walker_of(condition: Condition) -> Walker:
    """Return the published patient in a condition."""
    return build_walker(load_patient("sreenivasa2017-patient"), condition)


@cache
def stylised_series(condition: Condition = "orthosis") -> GaitSeries:
    """Return the stylised gait; its forces carry the weight at every instant."""
    walker = walker_of(condition)
    trajectory = stylised_trajectory(walker, GAIT)
    starts = np.concatenate([[0.0], np.cumsum(GAIT.durations)[:-1]])
    phases = tuple(
        _phase(walker, phase, trajectory, start, duration)
        for phase, start, duration in zip(PHASES, starts, GAIT.durations, strict=True)
    )
    parameters = STIFFNESS if walker.orthosis else np.zeros(0)
    series = gait_series(walker, PhasedMotion(phases, parameters))
    # At time 0 a series solves for the forces; here they are those of the first phase.
    return replace(series, force=np.concatenate([series.force[1:2], series.force[1:]]))


def _phase(
    walker: Walker, contact: ContactPhase, trajectory: Trajectory, start: float, duration: float
) -> PhaseMotion:
    mesh = np.linspace(0.0, 1.0, INTERVALS + 1)
    points = mesh[:-1, None] + np.diff(mesh)[:, None] * collocation_times(DEGREE)
    nodes, inner = (
        np.column_stack([trajectory.at(t), trajectory.rates_at(t)])
        for t in (start + duration * mesh, start + duration * points.ravel())
    )
    share = walker.weight / len(contact.points)
    force = np.array([share * (1.0 if f.bears else FRICTION) for f in contact.forces])
    zeros = np.zeros(len(COORDINATES))
    algebraic = np.tile(np.concatenate([zeros, force, zeros]), (INTERVALS, DEGREE, 1))
    return PhaseMotion(
        name=contact.name,
        duration=float(duration),
        mesh=mesh,
        states=nodes,
        smooth=np.full((INTERVALS + 1, len(GENERATORS)), ACTIVATION),
        controls=np.zeros((INTERVALS + 1, len(GENERATORS))),
        integrals=np.zeros((INTERVALS + 1, len(Costs().integrals))),
        inner_states=inner.reshape(INTERVALS, DEGREE, -1),
        algebraic=algebraic,
    )
