"""Soles that give way: closed forms of sinking, sliding and rolling, and a walk on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, with_values
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.model.compliance import depth_under, ground_force
from pathwalker_cli.model.contact import contact_pattern
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.stride.verify import second_engine_residual

PATIENT = load_patient("sreenivasa2017-patient")
SOLE = contact_pattern("compliant").points[0]
MASS, FRICTION = 30.0, 0.8
WEIGHT = MASS * 9.81
Law = Callable[[float, float, float], tuple[float, float]]


def law(depth: float = 0.017, damping: float = 0.85, creep: float = 0.01) -> Law:
    """Return the force on the sole by height [m] and velocity forward and up [m/s]."""
    numbers = dict(zip((n.address for n in SOLE.law), (depth, damping, creep), strict=True))
    return lambda z, vx, vz: ground_force(SOLE, z, (vx, vz), numbers, WEIGHT, FRICTION)


def moved(
    rate: Callable[[float, np.ndarray], np.ndarray], start: list[float], end: float
) -> np.ndarray:
    """Return where a stiff motion ends."""
    return np.asarray(solve_ivp(rate, (0.0, end), start, "Radau", rtol=1e-6, atol=1e-9).y[:, -1])


def test_a_dropped_mass_comes_to_rest_as_deep_as_its_weight_presses_it() -> None:
    force, depth = law(), 0.017

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        up = force(x[0], 0.0, x[1])[1]
        lost = up * x[1]  # power of the ground
        return np.array([x[1], up / MASS - 9.81, lost])

    height, speed, work = moved(rate, [0.1, 0.0, 0.0], 10.0)
    assert -height == pytest.approx(depth, rel=1e-3)
    assert speed == pytest.approx(0.0, abs=1e-4)
    assert work == pytest.approx(-WEIGHT * (0.1 + depth), rel=1e-3)  # all that gravity did
    numbers = {SOLE.law[0].address: depth}
    assert depth_under(SOLE, WEIGHT / 8.0, numbers, WEIGHT) == pytest.approx(depth / 2.0)
    assert force(0.05, 1.0, 0.0) == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("slope", [0.1, 0.5])
def test_a_block_creeps_down_a_slope_that_holds_it(slope: float) -> None:
    force = law(creep=0.01)

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        fx, fz = force(x[1], x[2], x[3])
        return np.array([x[2], x[3], fx / MASS + 9.81 * np.sin(slope),
                         fz / MASS - 9.81 * np.cos(slope)])  # fmt: skip

    speed = moved(rate, [0.0, 0.0, 0.0, 0.0], 3.0)[2]
    assert speed == pytest.approx(0.02 * np.arctanh(np.tan(slope) / FRICTION), rel=1e-3)


def test_friction_is_dry_where_a_foot_slides() -> None:
    for speed, share in ((0.01, 0.4621), (1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)):
        fx, fz = law()(-0.01, speed, 0.0)
        assert fx == pytest.approx(-share * FRICTION * fz, rel=1e-4)


def test_a_half_disc_that_gives_way_tends_to_the_one_that_rolls() -> None:
    """To first order in how deep it sinks and how fast it creeps, rocking by 0.6 rad."""
    radius, reach = 0.3, 0.6
    centre = 4.0 * radius / (3.0 * np.pi)
    inertia = MASS * (radius**2 / 2.0 - centre**2)

    def rolling(_: float, x: np.ndarray) -> np.ndarray:
        turn, speed = x
        cosine, sine = np.cos(turn), np.sin(turn)
        about = inertia + MASS * (radius**2 + centre**2 - 2.0 * radius * centre * cosine)
        moment = MASS * centre * sine * (9.81 + radius * speed**2)
        return np.array([speed, -moment / about])

    def yielding(force: Law) -> Callable[[float, np.ndarray], np.ndarray]:
        def rate(time: float, state: np.ndarray) -> np.ndarray:
            _, z, turn, vx, vz, speed = state  # of the disc's centre
            cosine, sine = np.cos(turn), np.sin(turn)
            fx, fz = force(z - radius, vx - radius * speed, vz)
            # the centre of mass hangs below by c, at (-c sin, -c cos)
            mass = np.array([[MASS, 0.0, -MASS * centre * cosine],
                             [0.0, MASS, MASS * centre * sine],
                             [-MASS * centre * cosine, MASS * centre * sine,
                              inertia + MASS * centre**2]])  # fmt: skip
            given = [fx - MASS * centre * sine * speed**2,
                     fz - WEIGHT - MASS * centre * cosine * speed**2,
                     -fx * radius - WEIGHT * centre * sine]  # fmt: skip
            return np.concatenate([[vx, vz, speed], np.linalg.solve(mass, given)])

        return rate

    exact = moved(rolling, [reach, 0.0], 0.7)[0]
    errors = []
    for part in (1.0, 0.5, 0.25):
        depth, creep = 4e-3 * part, 4e-3 * part
        start = [0.0, radius - depth, reach, 0.0, 0.0, 0.0]
        errors.append(moved(yielding(law(depth, 0.85, creep)), start, 0.7)[2] - exact)
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert orders == pytest.approx(1.0, abs=0.25)
    assert abs(errors[-1]) < 0.02


def test_the_law_pushes_the_walker_alike_in_numbers_and_in_expressions() -> None:
    walker, rng = build_walker(PATIENT, feet="compliant"), np.random.default_rng(0)
    n = walker.skeleton.size
    q, v = rng.uniform(-0.3, 0.3, n), rng.normal(size=n)
    q[1] = 0.6
    vdot, found = walker.contact_dynamics("right_step", q, v, np.zeros(n))
    position, velocity = (ca.SX(x) for x in walker.contact_motion(q, v))
    known = walker.values, walker.weight, walker.friction
    for i, place in enumerate(walker.pattern.points):
        moved = velocity[2 * i], velocity[2 * i + 1]
        forces = ground_force(place, position[2 * i + 1], moved, *known)
        assert [float(f) for f in forces] == pytest.approx(found[2 * i : 2 * i + 2])
    assert found[[1, 3]].max() > 1.0
    body, theta = walker.rigid_body, walker.rigid_body.parameters
    needed = np.array(body.inverse_dynamics(q, v, vdot, theta)).ravel()
    assert needed == pytest.approx(np.array(body.point_jacobian(q, theta)).T @ found, abs=1e-8)


def test_a_calf_that_is_too_short_walks_on_its_toes_without_any_phase() -> None:
    short = {f"examination.dorsiflexion_knee_{knee}.{side}": reach for side in ("right", "left")
             for knee, reach in (("extended", -20.0), ("flexed", -15.0))}  # fmt: skip
    values = {"numbers": short, "model.feet": "compliant", "mesh.intervals": (14, 14),
              "mesh.refinements": 0, "solver.tolerance": 1e-3, "verdict": False}  # fmt: skip
    solver = GaitSolver(Case.of(with_values(load_config("predict-barefoot"), values)))
    solution = solver.solve()
    assert solution.converged
    assert [phase.name for phase in solution.last_motion.phases] == ["right_step", "left_step"]
    series = gait_series(solution.walker, solution.last_motion)
    assert second_engine_residual(series) < 1e-6
    force = series.force.copy()
    force[:, 1] *= 1.01
    assert second_engine_residual(replace(series, force=force)) > 1.0
    found = balance(series)
    assert found.ground_loss > 0.0
    assert found.energy < 5e-2 * found.work_scale
    assert found.impulse < 1e-3 * found.impulse_scale
    stride, metrics = stride_of(series), metrics_of(stride_of(series))
    for side in ("right", "left"):
        up = series.vertical_force(side)
        assert up.min() > -1.0
        assert np.abs(series.forward_force(side)).max() <= FRICTION * up.max()
        assert np.interp(stride.toe_off(side) % stride.duration, stride.time, up) == (
            pytest.approx(LOADED, rel=1e-3)
        )
        assert np.interp(stride.strike(side), stride.time, up) == pytest.approx(LOADED, rel=0.1)
        assert 0.5 < metrics[f"stance_share_{side}"] < 0.7
        assert metrics[f"strike_index_{side}"] > 2 / 3  # lands on the forefoot
        assert metrics[f"rearmost_pressure_{side}"] > 2 / 3  # and stays there


@pytest.mark.parametrize(
    ("problem", "values", "sentence"),
    [
        ("mapd-barefoot", {"model.contact": "toe"}, "roll over whatever they land on"),
        ("mapd-barefoot", {"cost.goals": {"centre_of_pressure": 1.0}}, "a sole rolls"),
        ("mapd-barefoot", {"transcription": "multiple-shooting"}, "too quick for its steps"),
        ("ls-barefoot", {}, "follows phases"),
    ],
)
def test_what_soles_that_give_way_cannot_is_refused(
    problem: str, values: dict[str, object], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence):
        with_values(load_config(problem), {"model.feet": "compliant", **values})
