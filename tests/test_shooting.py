"""Direct multiple shooting: closed forms, a second integrator, differences, order, a gait."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from helpers import stylised_series, walker_of
from pathwalker_cli.case import load_case
from pathwalker_cli.config import load_config
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.gait.shooting import (
    EXCITATIONS,
    gait_shooting,
    rounded_rate,
    solve_shooting,
)
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.elements.muscle import (
    ACTIVATION_TIME,
    DEACTIVATION_TIME,
    activation_rate,
    excitation_from_rate,
)
from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.ocp.problem import (
    Boundary,
    BoundTable,
    MultiPhaseProblem,
    Phase,
    ProblemNumbers,
    Rows,
    Variables,
)
from pathwalker_cli.ocp.shooting import ShootingProgram
from pathwalker_cli.ocp.shooting_blocks import ShootingBlocks, ShootingProblem
from pathwalker_cli.ocp.shooting_motion import Shooter, ShootingNodes
from pathwalker_cli.ocp.shooting_steps import CASH_KARP, adaptive_steps, fixed_steps

STIFFNESS = np.array([40.0, 50.0, 10.0, 20.0])


@cache
def _blocks() -> ShootingBlocks:
    return ShootingBlocks(gait_shooting(GaitProblem(walker_of("orthosis"))))


@cache
def _numbers() -> ProblemNumbers:
    walker = walker_of("orthosis")
    shared = GaitProblem(walker).shared_values(
        {"effort": 1.0, "rate": 2e-2, "acceleration": 1e-3}, 0.8
    )
    table = gait_bounds(walker, load_config("mapd-orthosis").bounds).table
    excitations = {(name,): (0.0, 1.0) for name in EXCITATIONS}
    return ProblemNumbers(shared, table.replace(excitations), lambda phase, at: np.zeros(10))


def _random_nodes(intervals: int = 1, duration: float = 0.02) -> ShootingNodes:
    """Return a crouching walker with random velocities, activations and excitations at nodes."""
    rng, count = np.random.default_rng(7), len(PHASES)
    total = intervals * count + 1
    states = np.hstack([0.2 * rng.normal(size=(total, 10)), rng.normal(size=(total, 10))])
    states[:, [4, 7]] += 0.6
    smooth, controls = rng.uniform(0.05, 0.6, (total, 14)), rng.uniform(0.0, 1.0, (total, 14))

    def by_phase(values: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(values[i * intervals : (i + 1) * intervals + 1] for i in range(count))

    return ShootingNodes(
        (np.linspace(0.0, 1.0, intervals + 1),) * count,
        np.full(count, duration),
        STIFFNESS,
        by_phase(states),
        by_phase(smooth),
        by_phase(controls),
    )


@cache
def _program(rounding: float = 0.0) -> tuple[ShootingProgram, ShootingNodes]:
    """Return a program with two steps in the first of two intervals and one in the second."""
    nodes = _random_nodes(2, 0.01)
    edges = ((np.array([0.0, 0.4, 1.0]), np.array([0.0, 1.0])),) * len(PHASES)
    return ShootingProgram(_blocks(), _numbers(), nodes.meshes, edges, rounding), nodes


# Equation (2)


def test_without_rounding_the_rate_is_equation_2() -> None:
    e, a = np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 41))
    assert rounded_rate(e, a, 0.0) == pytest.approx(activation_rate(e, a), abs=1e-12)
    rising = (e - a) * (e / ACTIVATION_TIME + (1 - e) / DEACTIVATION_TIME)
    falling = (e - a) / DEACTIVATION_TIME
    assert rounded_rate(e, a, 0.0) == pytest.approx(np.where(e >= a, rising, falling), abs=1e-12)


def test_rounding_changes_the_rate_near_the_kink_only() -> None:
    e, a, width = np.linspace(0, 1, 101), 0.5, 1e-2
    change = rounded_rate(e, a, width) - activation_rate(e, a)
    faster = 1 / ACTIVATION_TIME - 1 / DEACTIVATION_TIME
    assert change.max() == pytest.approx(faster * 0.5 * width / 2, rel=1e-9)
    assert change.min() >= 0
    assert change[np.abs(e - a) > 0.3].max() < faster * width**2 / (4 * 0.3)


def test_deactivation_follows_its_exponential() -> None:
    """Constant e below a: a - e decays with tau_D."""

    def slope(time: float, a: np.ndarray) -> np.ndarray:
        return rounded_rate(np.array([0.1]), a, 0.0)

    steps = adaptive_steps(slope, np.array([0.9]), (0.0, 0.1), np.ones(1), 1e-10)
    wanted = 0.1 + 0.8 * np.exp(-0.1 / DEACTIVATION_TIME)
    assert steps[-1].end[0] == pytest.approx(wanted, abs=1e-9)
    assert excitation_from_rate(slope(0.0, np.array([0.9])), np.array([0.9])) == pytest.approx(0.1)


# The integrator


def test_the_pair_meets_the_order_conditions() -> None:
    """Quadrature conditions up to the order of step and of the embedded scheme."""
    c, b, embedded = CASH_KARP.times, CASH_KARP.weights, CASH_KARP.weights - CASH_KARP.error
    assert (b >= 0).all()
    for k in range(5):
        assert b @ c**k == pytest.approx(1 / (k + 1), abs=1e-14)
        if k < 4:
            assert embedded @ c**k == pytest.approx(1 / (k + 1), abs=1e-14)


def test_steps_converge_with_their_order() -> None:
    def slope(time: float, x: np.ndarray) -> np.ndarray:
        return np.array([x[1], -x[0] * (1 + 0.5 * np.sin(time)) - x[1] ** 3])

    start, scale = np.array([1.0, 0.3]), np.ones(2)
    exact = solve_ivp(slope, (0, 2), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    errors = [
        np.abs(fixed_steps(slope, start, np.linspace(0, 2, n + 1), scale)[-1].end - exact).max()
        for n in (8, 16, 32)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(5.0, abs=0.4)


def test_chosen_steps_keep_the_error_estimate_below_the_tolerance() -> None:
    nodes = _random_nodes()
    shooter = Shooter(_blocks(), _numbers(), nodes)
    for tolerance in (1e-4, 1e-6):
        edges = shooter.choose(tolerance)
        assert shooter.error(edges) <= tolerance
        assert all(ends[0] == 0.0 and ends[-1] == 1.0 for (ends,) in edges)


@pytest.mark.parametrize("i", [0, 1, 3, 6])
def test_interval_map_agrees_with_a_second_integrator_and_model(i: int) -> None:
    """DOP853 with contact dynamics in NumPy from numeric muscle and orthosis curves."""
    nodes, walker = _random_nodes(duration=0.005), walker_of("orthosis")
    shooter = Shooter(_blocks(), _numbers(), nodes)
    ends = shooter.ends(i, 0, 1e-8)
    end = shooter.steps(i, 0, ends)[-1].end
    left, right = nodes.controls[i]
    duration = nodes.durations[i]

    def slope(time: float, state: np.ndarray) -> np.ndarray:
        q, v, a = np.split(state, [10, 20])
        muscle = walker.muscle_torques(q, v, a)
        orthosis = walker.orthosis_torques(q, STIFFNESS[:2], STIFFNESS[2:])
        vdot, _ = walker.contact_dynamics(i, q, v, walker.joint_torques(muscle, orthosis))
        e = left + time / duration * (right - left)
        return np.concatenate([v, vdot, activation_rate(e, a)])

    start = shooter.start(i, 0)[:34]
    exact = solve_ivp(slope, (0, duration), start, method="DOP853", rtol=1e-8, atol=1e-9)
    # some 50 steps on both sides, each off by up to 1e-8 of a state, or of 1 where that is more
    assert end[:34] == pytest.approx(exact.y[:, -1], rel=2e-6, abs=2e-6)


# The program


def test_integrated_stages_meet_the_rows_of_the_program() -> None:
    """An integrated motion misses only ends of intervals, path and boundary rows."""
    program, nodes = _program()
    rows = np.asarray(program.functions["nlp"](
        program.from_nodes(nodes), program.parameters)[1]).ravel()  # fmt: skip
    places = [program.row_place(k) for k in range(rows.size)]
    formulae = [k for k, (name, _) in enumerate(places) if " at stage " in name]
    inside = [k for k, (name, where) in enumerate(places)
              if name.endswith(" at end") and where.endswith("interval 1 step 1")]  # fmt: skip
    equations = [k for k, (name, _) in enumerate(places)
                 if name.endswith(("equation of motion", "contact acceleration"))]  # fmt: skip
    assert len(formulae) == 8 * 3 * 5 * 34
    assert len(inside) == 8 * 34
    assert np.abs(rows[formulae]).max() < 1e-12
    assert np.abs(rows[inside]).max() < 1e-12
    assert np.abs(rows[equations]).max() < 1e-9


def test_derivatives_agree_with_finite_differences() -> None:
    program, nodes = _program(0.05)
    functions, p = program.functions, program.parameters
    rng = np.random.default_rng(3)
    x = program.from_nodes(nodes) + 1e-2 * rng.normal(size=program.size)
    lam = rng.normal(size=program.rows)
    jacobian = ca.DM(functions["jac_g"](x, p)[1])
    hessian = ca.DM(functions["hess_lag"](x, p, 0.7, lam))
    hessian = hessian + ca.triu(hessian, False).T

    def gradient(at: np.ndarray) -> Any:
        slopes = functions["grad_f"](at, p)[1], functions["jac_g"](at, p)[1]
        return 0.7 * slopes[0] + ca.mtimes(ca.DM(slopes[1]).T, lam)

    for _ in range(4):  # random directions cover all unknowns at once
        way = rng.normal(size=x.size)
        h = 1e-6
        values = [np.asarray(functions["nlp"](x + s * h * way, p)[1]).ravel() for s in (1, -1)]
        slope = (values[0] - values[1]) / (2 * h)
        assert slope == pytest.approx(np.asarray(jacobian @ way).ravel(), rel=1e-5, abs=1e-5)
        bend = np.asarray(gradient(x + h * way) - gradient(x - h * way)).ravel() / (2 * h)
        assert bend == pytest.approx(np.asarray(hessian @ way).ravel(), rel=1e-4, abs=1e-3)


def test_no_row_and_no_unknown_is_constrained_twice() -> None:
    """The Jacobian of equalities has full rank at a random point: no zero in its triangle."""
    program, nodes = _program()
    (lower, upper), (low, high) = program.bounds, program.row_bounds
    jacobian = ca.DM(program.functions["jac_g"](program.from_nodes(nodes), program.parameters)[1])
    rows, columns = np.flatnonzero(low == high), np.flatnonzero(lower < upper)
    equal = jacobian[rows.tolist(), columns.tolist()]
    assert equal.size1() < equal.size2()
    triangle = ca.qr_sparse(equal.T)[1]
    assert float(ca.mmin(ca.fabs(ca.diag(triangle)))) > 1e-6


def test_nodes_and_unknowns_are_inverse_and_the_motion_keeps_its_nodes() -> None:
    program, nodes = _program()
    back = program.nodes(program.from_nodes(nodes))
    for name in ("states", "smooth", "controls"):
        for wanted, found in zip(getattr(nodes, name), getattr(back, name), strict=True):
            assert found == pytest.approx(wanted, abs=1e-12)
    motion = program.to_motion(program.from_nodes(nodes))
    assert motion.durations == pytest.approx(nodes.durations)
    assert motion.phases[3].states[0] == pytest.approx(back.states[3][0], abs=1e-12)
    assert [phase.intervals for phase in motion.phases] == [3] * len(PHASES)


def test_a_motion_gives_its_states_and_excitations() -> None:
    motion = stylised_series("orthosis").motion
    nodes = ShootingNodes.of(_blocks().shooting, motion)
    assert nodes.states[2] == pytest.approx(motion.phases[2].states)
    rate = activation_rate(nodes.controls[0], nodes.smooth[0])
    assert rate == pytest.approx(motion.phases[0].controls, abs=1e-9)


# A textbook problem


def _double_integrator() -> tuple[ShootingProblem, ProblemNumbers]:
    """Return: move a unit mass by 1 m from rest to rest in 1 s with least integral of force^2.

    Two phases of 0.5 s; the force is a smooth state and its rate the control; optimum 12, with the
    force 6 - 12 t.
    """
    x = Variables.make("x", ("position", "speed"), np.array([1.0, 2.0]))
    y, u, p = (Variables.make(k, (k,), 1.0) for k in ("force", "rate", "free"))
    mass, data = ca.SX.sym("mass"), ca.SX.sym("data")
    z = Variables.make("z", ("acceleration", "unused"), 5.0)
    phases = tuple(
        Phase(
            name=name,
            algebraic=z,
            derivative=ca.vertcat(x.symbol[1], z.symbol[0]),
            residual=Rows.make(mass * z.symbol[0] - y.symbol, ("newton",), 3.0),
            path=Rows.make(x.symbol[1], ("forward",), 1.0, -10.0, np.inf),
            end=Rows(),
            fixed_at_end=(),
            integrands=y.symbol**2,
            frozen=FrozenTerms(),
        )
        for name in ("first", "second")
    )
    first = cast(Any, tuple(ca.SX.sym(f"f{i}", k) for i, k in enumerate((2, 1, 1))))
    last = cast(Any, tuple(ca.SX.sym(f"l{i}", k) for i, k in enumerate((2, 1, 1))))
    rows = Rows.make(
        ca.vertcat(first[0], last[0] - ca.vertcat(1, 0)), ("x0", "v0", "x1", "v1"), 1.0
    )
    integrals = ca.SX.sym("s", 1)
    boundary = Boundary(first, last, ca.SX.sym("T", 2), integrals, rows, integrals[0])
    problem = MultiPhaseProblem(
        states=x,
        smooth=y,
        controls=u,
        parameters=p,
        shared=mass,
        point_data=data,
        integrals=("effort",),
        integral_scale=np.array([10.0]),
        phases=phases,
        node_rows=Rows(),
        boundary=boundary,
    )
    shooting = ShootingProblem(problem, u, lambda e, y, rounding: e, lambda rate, y: rate)
    bounds = BoundTable({("duration",): (0.5, 0.5), ("free",): (0.0, 0.0)})
    return shooting, ProblemNumbers(np.array([1.0]), bounds, lambda phase, at: np.zeros(1))


def test_double_integrator_reaches_the_closed_form_optimum() -> None:
    shooting, numbers = _double_integrator()
    blocks = ShootingBlocks(shooting)
    meshes = (np.linspace(0.0, 1.0, 4),) * 2
    rest = np.zeros((4, 1))
    nodes = ShootingNodes(
        meshes, np.full(2, 0.5), np.zeros(1), (np.zeros((4, 2)),) * 2, (rest,) * 2, (rest,) * 2
    )
    edges = Shooter(blocks, numbers, nodes).choose(1e-6)
    program = ShootingProgram(blocks, numbers, meshes, edges)
    start = program.from_nodes(nodes)
    result = solve_program(program, start, IpoptSettings(tolerance=1e-9))
    assert result.converged
    assert result.objective == pytest.approx(12.0, rel=1e-9)
    found = program.nodes(result.unknowns)
    for i in range(2):
        time = 0.5 * (i + meshes[i])
        wanted = np.column_stack([3 * time**2 - 2 * time**3, 6 * time - 6 * time**2])
        assert found.states[i] == pytest.approx(wanted, abs=1e-8)
        assert found.smooth[i][:, 0] == pytest.approx(6 - 12 * time, abs=1e-7)


FINE = (24, 34, 4, 12, 56, 6, 6, 12)
"""Intervals of some 7 ms: on longer ones the two kinds of controls differ too much."""


@pytest.mark.slow
def test_barefoot_prediction_agrees_with_collocation() -> None:
    """Cost, stride time and walking speed within 1 %, phases within 1 % of the stride time."""
    case = load_case("mapd-barefoot")
    coarse, config = GaitSolver(case).solve(), case.config
    mesh = config.mesh.model_copy(update={"intervals": FINE, "refinements": 0})
    barrier = config.solver.model_copy(update={"warm_barrier": 1e-6})
    finer = config.model_copy(update={"mesh": mesh, "solver": barrier})
    solver = GaitSolver(replace(case, config=finer))
    solution = solver.solve(coarse.last_motion)
    assert solution.converged
    motion = solution.last_motion
    numbers = solver.prediction
    shot = solve_shooting(solver.gait, numbers, motion)
    assert shot.converged
    assert shot.violations[0].amount < 1e-6
    assert shot.integration_error < 1e-4
    assert shot.defect < 1e-5
    assert shot.cost == pytest.approx(solution.cost, rel=1e-2)
    durations = shot.nodes.durations
    assert durations.sum() == pytest.approx(motion.duration, rel=1e-2)
    assert durations == pytest.approx(motion.durations, abs=1e-2 * motion.duration)
    series = solution.series
    speed = walked_distance(shot.motion) / shot.motion.duration
    assert speed == pytest.approx(series.distance / series.duration, rel=1e-2)
