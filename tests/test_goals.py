"""Clinical goals: values and derivatives against formulas written anew; what configs may ask."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from helpers import stylised_series
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.conventions import ANGLES, COORDINATES, GENERATORS
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.cost_terms import goal_values, with_goal_costs
from pathwalker_cli.gait.costs import BASE, GOALS, Costs, Instant, Totals
from pathwalker_cli.gait.solve import solve_study
from pathwalker_cli.model.contact import PHASES, POINTS, phase_named
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.stride import stride_of

WALKER = stylised_series("barefoot").walker
WEIGHT = WALKER.weight
RANGES = {"knee_r": (0.3, 0.5), "lumbar": (0.0, 0.1)}
EVERY = Costs(tuple(GOALS), comfort_ranges=RANGES)
N = len(COORDINATES)


def expected(motion: PhasedMotion) -> dict[str, float]:
    """Return all values by the formulas of docs/theory.md, by trapezoids on a fine grid."""
    crouch = pressure = peak = discomfort = first = stumbling = 0.0
    differences = np.zeros(3)
    for i, phase in enumerate(motion.phases):
        at = np.linspace(0.0, 1.0, 2001)
        x, a = phase.states_at(at), phase.smooth_at(at)
        contact = phase_named(phase.name)
        angle = {name: x[:, k] for k, name in enumerate(COORDINATES)}

        def over(values: Any, at: np.ndarray = at, duration: float = phase.duration) -> float:
            return duration * float(np.trapezoid(np.broadcast_to(values, at.shape), at))

        crouch += sum(over(angle[f"knee_{s}"] ** 2) for s in {side[0] for side in contact.feet})
        # forces of the made motion do not change within a phase
        force = phase.algebraic[0, 0, N : N + len(contact.forces)]
        load = dict(zip(contact.force_names, force, strict=True))
        for s in "rl":
            arm = load.get(f"toe_{s}_z", 0.0) - load.get(f"heel_{s}_z", 0.0)
            pressure += over((arm / WEIGHT) ** 2)
        peak += over((a**8).sum(axis=1))
        for name, (lower, upper) in RANGES.items():
            for beyond in (angle[name] - upper, lower - angle[name]):
                discomfort += over((0.5 * (beyond + np.hypot(beyond, 0.01))) ** 2)
        first += over(x[:, N]) if i < 4 else 0.0
        q, step = x[:, :N], 1e-6 * x[:, N:]
        places, ahead, behind = (
            np.array([WALKER.contact_points(row) for row in rows])
            for rows in (q, q + step, q - step)
        )
        for k, point in enumerate(POINTS):
            if point not in contact.points:
                speed = (ahead - behind)[:, k, 0] / 2e-6
                stumbling += over(speed**2 * (1.0 + (places[:, k, 1] / 0.015) ** 2) ** -2)
        joints = ("hip", "knee", "ankle")
        differences += [over(angle[f"{j}_r"] - angle[f"{j}_l"]) for j in joints]
    time, times = motion.duration, np.array(motion.durations)
    distance = motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0]
    asymmetry = ((2 * first - distance) / distance) ** 2
    asymmetry += float((((times[:4] - times[4:]) / time) ** 2).sum())
    asymmetry += float(((differences / time) ** 2).sum())
    return {
        "clear_ground": stumbling / distance,
        "crouch": crouch / time,
        "asymmetry": asymmetry,
        "centre_of_pressure": pressure / time,
        "peak_activation": (peak / time + 1e-6) ** 0.125,
        "discomfort": discomfort / time,
    }


def test_values_are_those_of_the_formulas() -> None:
    motion = stylised_series("barefoot").motion
    found, wanted = goal_values(motion, WALKER, RANGES), expected(motion)
    assert set(found) == set(GOALS)
    for name, value in wanted.items():
        # ranges of comfort that cover every other joint still cost their rounded edge
        # how near the ground is changes within an interval as no polynomial of its points does
        rel = 1e-2 if name == "clear_ground" else 2e-3
        assert found[name] == pytest.approx(value, rel=rel, abs=1e-4), name
    assert "discomfort" not in goal_values(motion, WALKER, {})


def test_the_loading_rate_is_that_of_forces_known_in_closed_form() -> None:
    """Both places of a foot share its load, which rises by a polynomial that a mesh holds."""
    motion, phases, wanted = stylised_series("barefoot").motion, [], 0.0
    for phase in motion.phases:
        contact, at = phase_named(phase.name), phase.point_fractions
        algebraic = phase.algebraic.copy()
        for i, force in enumerate(contact.forces):
            size = 1.0 + (force.point.side == "left")
            algebraic[..., N + i] = size * WEIGHT * (3.0 * at**2 - at)
        phases.append(replace(phase, algebraic=algebraic))
        for side in contact.feet:
            places = sum(force.bears for force in contact.forces if force.point.side == side)
            size = places * (1.0 + (side == "left"))
            # the mean of (6 s - 1)^2 over s from 0 to 1 is 7
            wanted += 7.0 * size**2 / phase.duration
    made = replace(motion, phases=tuple(phases))
    distance = motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0]
    value = goal_values(made, WALKER, {})["loading_rate"]
    assert value == pytest.approx(wanted / distance, rel=1e-9)
    # forces that do not change cost nothing
    assert goal_values(motion, WALKER, {})["loading_rate"] == pytest.approx(0.0, abs=1e-12)


def test_gentle_loading_costs_what_finer_differences_of_the_solution_say() -> None:
    config = smoke_version(load_config("mapd-barefoot"))
    weighed = with_values(config, {"cost.goals": {"loading_rate": 3e-3}})
    plain, gentle = solve_study(config), solve_study(weighed)
    assert gentle.converged
    rates = []
    for solution in (plain, gentle):
        motion, total = solution.last_motion, 0.0
        for phase in motion.phases:
            forces = phase_named(phase.name).forces
            for start, end in zip(phase.mesh, phase.mesh[1:], strict=False):
                at = np.linspace(start, end, 2001)[1:-1]
                force = phase.algebraic_at(at)[:, N : N + len(forces)]
                for side in ("right", "left"):
                    mine = [i for i, f in enumerate(forces) if f.bears and f.point.side == side]
                    rate = np.gradient(force[:, mine].sum(axis=1), at * phase.duration)
                    total += float(np.mean((rate / WEIGHT) ** 2)) * (end - start) * phase.duration
        distance = motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0]
        rates.append(total / distance)
    assert gentle.cost_terms["loading_rate"] == pytest.approx(3e-3 * rates[1], rel=1e-2)
    assert rates[1] < 0.8 * rates[0]


def test_cuffs_press_with_the_torque_over_their_height() -> None:
    series = stylised_series("orthosis")
    walker, stride = series.walker, stride_of(series)
    height, weight = walker.patient.cuff_height("right"), walker.weight
    assert height == pytest.approx(0.7 * 0.2834)
    found = metrics_of(stride)
    torque = series.orthosis_torque
    assert found["peak_shin_force_right"] == pytest.approx(max(torque[:, 0].max(), 0.0) / height)
    assert found["peak_calf_force_right"] == pytest.approx(max(-torque[:, 0].min(), 0.0) / height)
    largest = max(found["peak_shin_force_right"], found["peak_calf_force_right"])
    area = walker.patient.cuff_area("right")
    assert found["peak_cuff_pressure_right"] == pytest.approx(largest / area)
    heights = np.array([walker.patient.cuff_height(side) for side in ("right", "left")])
    squares = ((torque / heights / weight) ** 2).sum(axis=1)
    value = goal_values(series.motion, walker, {})["cuff_load"]
    assert value == pytest.approx(series.quadrature @ squares / stride.distance, rel=1e-9)
    assert value > 0.0
    assert goal_values(stylised_series("barefoot").motion, WALKER, {})["cuff_load"] == 0.0
    assert metrics_of(stride_of(stylised_series("barefoot")))["peak_shin_force_right"] is None


def test_the_strike_index_tells_heel_from_toe() -> None:
    found = metrics_of(stride_of(stylised_series("barefoot")))
    assert found["strike_index_right"] == pytest.approx(0.0, abs=1e-9)  # lands on its heel
    flat = build_walker(WALKER.patient, feet="sole")
    assert flat.contact_points(np.zeros(N))[0, 0] == pytest.approx(
        flat.foot_points(np.zeros(N))[:2, 0].mean()
    )


def test_running_costs_of_a_start_add_up_to_the_values() -> None:
    motion = with_goal_costs(stylised_series("barefoot").motion, EVERY, WALKER)
    costs = dict(zip(EVERY.integrals, motion.phases[-1].integrals[-1], strict=True))
    distance = motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0]
    values = EVERY.goal_values(
        Totals(costs, distance, motion.duration, list(motion.durations), PHASES)
    )
    assert values == pytest.approx(goal_values(motion, WALKER, RANGES))
    for before, after in zip(motion.phases, motion.phases[1:], strict=False):
        assert np.allclose(before.integrals[-1], after.integrals[0])


@pytest.mark.parametrize("name", GOALS)
@pytest.mark.parametrize("phase", [PHASES[0], PHASES[3], PHASES[6]], ids=lambda phase: phase.name)
def test_derivatives_of_running_costs_are_those_of_differences(name: str, phase: Any) -> None:
    goals, rng = Costs((name,), comfort_ranges=RANGES), np.random.default_rng(4)
    sizes = [N, N, len(GENERATORS), len(phase.forces)]
    point = np.concatenate([rng.uniform(0.1, 0.9, sum(sizes[:3])), 100 * rng.random(sizes[3])])
    numbers = list(goals.numbers(WALKER))

    def costs(x: np.ndarray) -> np.ndarray:
        parts = [list(part) for part in np.split(x, np.cumsum(sizes)[:-1])]
        point = Instant(
            phase, *parts, force_rate=parts[3][::-1],
            heights=parts[0][:2], speeds=parts[1][:2], cuffs=parts[0][2:6],
        )  # fmt: skip
        return np.array(goals.integrands(point, numbers, goals.goals), dtype=float)

    x = ca.SX.sym("x", sum(sizes))
    parts = [ca.vertsplit(part) for part in ca.vertsplit(x, [0, *np.cumsum(sizes).tolist()])]
    point_of_symbols = Instant(
        phase, *parts, force_rate=parts[3][::-1],
        heights=parts[0][:2], speeds=parts[1][:2], cuffs=parts[0][2:6],
    )  # fmt: skip
    symbols = ca.vertcat(*goals.integrands(point_of_symbols, numbers, goals.goals))
    jacobian = np.asarray(ca.Function("j", [x], [ca.jacobian(symbols, x)])(point))
    assert np.asarray(ca.Function("c", [x], [symbols])(point)).ravel() == pytest.approx(
        costs(point)
    )
    for k, step in enumerate(1e-6 * np.eye(len(point))):
        change = (costs(point + step) - costs(point - step)) / 2e-6
        assert jacobian[:, k] == pytest.approx(change, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("name", GOALS)
def test_derivatives_of_values_are_those_of_differences(name: str) -> None:
    goals, rng = Costs((name,)), np.random.default_rng(5)
    names = GOALS[name].integrals
    count = len(names)
    point = rng.uniform(0.1, 0.6, count + 10)

    def value(x: Any) -> Any:
        costs = {integral: x[i] for i, integral in enumerate(names)}
        durations = [x[count + 2 + i] for i in range(8)]
        return goals.goal_values(Totals(costs, x[count], x[count + 1], durations, PHASES))[name]

    x = ca.SX.sym("x", len(point))
    gradient = np.asarray(ca.Function("g", [x], [ca.gradient(value(x), x)])(point)).ravel()
    for k, step in enumerate(1e-6 * np.eye(len(point))):
        change = (value(point + step) - value(point - step)) / 2e-6
        assert gradient[k] == pytest.approx(change, rel=1e-5, abs=1e-8)


def test_a_solve_with_every_goal_adds_up_and_trades_effort_for_them() -> None:
    weights = {"crouch": 5.0, "asymmetry": 1.0, "centre_of_pressure": 1.0, "discomfort": 5.0,
               "peak_activation": 0.5}  # fmt: skip
    changes = {"cost.goals": weights, "cost.comfort_ranges": {"lumbar": (-0.1, 0.3)},
               "cost.activation_power": 3}  # fmt: skip
    config = with_values(smoke_version(load_config("mapd-barefoot")), changes)
    solution = solve_study(config)
    assert solution.converged
    terms = solution.cost_terms
    assert sum(terms.values()) == pytest.approx(solution.cost, rel=1e-8)
    found = goal_values(solution.last_motion, solution.walker, config.cost.comfort_ranges)
    for name, weight in weights.items():
        assert terms[name] == pytest.approx(weight * found[name], rel=1e-8), name
    plain = solve_study(smoke_version(load_config("mapd-barefoot")))
    before = goal_values(plain.last_motion, plain.walker, config.cost.comfort_ranges)
    total = sum(weight * before[name] for name, weight in weights.items())
    assert sum(terms[name] for name in weights) < 0.9 * total


@pytest.mark.parametrize(
    ("problem", "changes", "sentence"),
    [
        ("mapd-barefoot", {"goals": {"speed": 1.0}}, "names 'speed'.*crouch"),
        ("mapd-barefoot", {"goals": {"crouch": -1.0}}, "goals.crouch"),
        ("mapd-barefoot", {"goals": {"discomfort": 1.0}}, "add comfort_ranges"),
        ("mapd-barefoot", {"comfort_ranges": {"knee": (0.0, 1.0)}}, "names 'knee'.*knee_r"),
        ("mapd-barefoot", {"comfort_ranges": {"knee_r": (1.0, 0.0)}}, "upside down"),
        ("mapd-barefoot", {"activation_power": 1}, "activation_power"),
        ("ls-barefoot", {"goals": {"crouch": 1.0}}, "follows a recording"),
        ("mapd-healthy", {"goals": {"asymmetry": 1.0}}, "symmetric already"),
    ],
)
def test_goals_that_cannot_be_are_refused(
    problem: str, changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence):
        with_values(load_config(problem), {f"cost.{key}": v for key, v in changes.items()})


def test_a_goal_of_rates_of_forces_is_refused_by_multiple_shooting() -> None:
    changes = {"cost.goals": {"loading_rate": 1e-3}, "transcription": "multiple-shooting"}
    with pytest.raises(ConfigError, match=r"loading_rate.*collocation alone"):
        with_values(load_config("mapd-barefoot"), changes)


def test_ranges_are_of_coordinates_that_are_angles() -> None:
    assert "pelvis_tz" not in ANGLES
    assert len(ANGLES) == 8


def test_goals_see_rates_and_accelerations_after_a_solve_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = {}

    def look(point: Instant) -> tuple[Any, ...]:
        seen.update(rate=point.rate, vdot=point.vdot, excitation=point.excitation)
        return (point.vdot[1] ** 2 + point.rate[0] ** 2,)

    term = replace(GOALS["crouch"], integrands=look)
    monkeypatch.setitem(GOALS, "crouch", term)
    motion = stylised_series("barefoot").motion
    assert goal_values(motion, WALKER, {})["crouch"] >= 0.0
    assert len(seen["rate"]) == len(seen["excitation"]) == len(GENERATORS)
    assert len(seen["vdot"]) == N


def test_running_costs_have_names_of_their_own() -> None:
    """Integrals are looked up by name: two terms that share one would share its value too."""
    running = [name for term in (*BASE.values(), *GOALS.values()) for name in term.integrals]
    assert len(running) == len(set(running))
