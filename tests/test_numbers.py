"""Named numbers: addresses, ties, ranges, derivatives, and what a free number means everywhere."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from pathwalker_cli.case import Case, load_case
from pathwalker_cli.config import load_config
from pathwalker_cli.conventions import COORDINATES, STIFFNESSES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.patient import load_patient

FREE = {
    "orthosis.neutral_angle": (-0.05, 0.03),
    "orthosis.dorsiflexion_stop.right": (-0.3, -0.09),
    "orthosis.dorsiflexion_stop.left": (-0.3, -0.09),
    "orthosis.plantarflexion_stop": (0.08, 0.3),
    "orthosis.preload_torque.left": (0.5, 2.0),
    "strengths.knee_flexion": (10.0, 20.0),
    "strengths.ankle_extension.right": (15.0, 30.0),
    "strengths.lumbar_flexion": (20.0, 30.0),
    "orthosis.mass.foot": (0.3, 0.9),
}


@pytest.fixture(scope="module")
def solver() -> GaitSolver:
    config = load_config("mapd-orthosis").model_copy(update={"free": FREE})
    return GaitSolver(Case.of(config))


@pytest.fixture(scope="module")
def walker() -> Walker:
    return build_walker(load_patient("sreenivasa2017-patient"), "orthosis")


def test_every_number_has_one_address_and_one_name(walker: Walker) -> None:
    addresses = [number.address for number in walker.numbers]
    names = [number.full_name for number in walker.numbers]
    assert len(set(addresses)) == len(set(names)) == len(addresses) == 14 + 2 * 10 + 4
    for number in walker.numbers:
        assert walker.values[number.address] == number.value_for(walker.patient)


def test_every_number_can_be_free_for_each_side_and_for_both(walker: Walker) -> None:
    for number in walker.numbers:
        for address in {number.address, number.place}:
            free = build_walker(walker.patient, "orthosis", free=(address,))
            unknown = next(u for u in free.unknowns if number.address in u.addresses)
            assert len(unknown.numbers) == (1 if address == number.address else 2)
            others = sum(name in STIFFNESSES for name in (u.name for u in free.unknowns))
            assert others == 4 - sum(n.full_name in STIFFNESSES for n in unknown.numbers) + (
                unknown.name in STIFFNESSES
            )


def test_springs_come_first_in_the_order_that_runs_have(solver: GaitSolver) -> None:
    names = [unknown.name for unknown in solver.walker.unknowns]
    assert names[:4] == list(STIFFNESSES)
    assert [unknown.address for unknown in solver.walker.unknowns[4:]] == list(FREE)


@pytest.mark.parametrize(
    ("free", "sentence"),
    [
        ({"orthosis.colour": (0, 1)}, "names 'orthosis.colour', which is no number"),
        ({"strengths.knee": (1, 2)}, r"no number of this walker.*strengths\.knee_extension"),
        ({"orthosis.free_play": (0.01, 0.02), "orthosis.free_play.left": (0.01, 0.02)}, "twice"),
        ({"strengths.knee_flexion": (-1, 10)}, r"reaches -1 N m.*0\.1 to 500"),
        ({"orthosis.neutral_angle": (-3, 0)}, r"reaches -3 rad.*is it in degrees"),
        ({"orthosis.neutral_angle": (-0.2, 0.05)}, "neutral_angle .* not between the right stops"),
        ({"orthosis.dorsiflexion_stop": (-0.3, -0.02)}, r"free\.orthosis\.dorsiflexion_stop"),
        (
            {
                "orthosis.stiffness_guess.dorsiflexion": (1.0, 90.0),
                "orthosis.preload_torque": (0.0, 1.0),
                "orthosis.stop_stiffness.dorsiflexion": (300.0, 999.0),
            },
            r"free\.orthosis\.stiffness_guess.*too far from stop_stiffness",
        ),
    ],
)
def test_what_cannot_be_free_is_refused(
    free: dict[str, tuple[float, float]], sentence: str
) -> None:
    config = load_config("mapd-orthosis").model_copy(update={"free": free})
    with pytest.raises(ConfigError, match=f"(?s){sentence}"):
        GaitSolver(Case.of(config))


def test_a_number_that_is_upside_down_or_single_is_refused() -> None:
    for value in ("[0.1, -0.1]", "0.1"):
        with pytest.raises(ConfigError, match="free"):
            load_config("mapd-orthosis", changes=(f"free.orthosis.neutral_angle={value}",))


def test_half_a_cycle_takes_both_sides_only() -> None:
    one = load_case("mapd-healthy", changes=("free={strengths.knee_flexion.left: [5, 50]}",))
    with pytest.raises(ConfigError, match="frees one side alone"):
        GaitSolver(one)
    both = load_case("mapd-healthy", changes=("free={strengths.knee_flexion: [5, 50]}",))
    assert [u.name for u in GaitSolver(both).walker.unknowns] == ["knee_flexion_strength"]


def test_residuals_are_those_of_the_walker_with_these_numbers(solver: GaitSolver) -> None:
    """Equations of motion of the blocks, by value and in every free number by differences."""
    block = CollocationBlocks(solver.gait.build(), solver.blocks.degree).phases[4].residual
    value_of, jacobian_of, hessian_of = block.functions.values()
    problem, unknowns = solver.blocks.problem, solver.walker.unknowns
    rng = np.random.default_rng(5)
    x = 0.3 * rng.normal(size=block.expressions.unknowns.numel())
    inside = [np.mean(solver.bounds.ranges[unknown.name]) for unknown in unknowns]
    x[1 : 1 + len(unknowns)] = np.array(inside) / problem.parameters.scale
    data = np.concatenate([[0.1, 0.5], np.zeros(len(COORDINATES))])
    shared = solver.prediction.shared
    jacobian = np.asarray(ca.DM(jacobian_of(x, data, shared)[0]))
    lam = rng.normal(size=block.rows)
    hessian = np.asarray(ca.DM(hessian_of(x, data, shared, 0.0, lam)))
    hessian = hessian + np.triu(hessian, 1).T
    h = 1e-5
    for k, unknown in enumerate(unknowns, start=1):
        e = h * (np.arange(x.size) == k)
        values = [np.asarray(value_of(x + s * e, data, shared)[0]).ravel() for s in (1, -1)]
        change = (values[0] - values[1]) / (2 * h)
        assert jacobian[:, k] == pytest.approx(change, abs=1e-5), unknown.name
        slopes = [np.asarray(ca.DM(jacobian_of(x + s * e, data, shared)[0])) for s in (1, -1)]
        bend = (slopes[0] - slopes[1]).T @ lam / (2 * h)
        assert hessian[:, k] == pytest.approx(bend, abs=1e-3), unknown.name
    moved = np.abs(jacobian[:, 1 : 1 + len(unknowns)]).max(axis=0) > 1e-6
    # the ankles of this pose reach neither K_P nor the stops
    assert np.count_nonzero(moved) == len(unknowns) - 5


def test_masses_shift_the_bodies_exactly(walker: Walker) -> None:
    free = build_walker(walker.patient, "orthosis", free=("orthosis.mass.foot",))
    unknown = free.unknowns[-1]
    more = free.with_parameters([40.0, 50.0, 10.0, 20.0, 0.9])
    moved = free.rigid_body.parameters + sum(
        (0.9 - free.values[number.address]) * free.body_slopes(number) for number in unknown.numbers
    )
    # the model passes through URDF text of nine digits
    assert more.rigid_body.parameters == pytest.approx(moved, rel=1e-7, abs=1e-9)
    assert more.total_mass - free.total_mass == pytest.approx(2 * (0.9 - 0.688), abs=1e-6)
    assert more.stiffness.tolist() == [40.0, 50.0, 10.0, 20.0]


def test_holding_numbers_keeps_the_structure(solver: GaitSolver) -> None:
    values = {unknown: unknown.value(solver.walker.values) for unknown in solver.walker.unknowns}
    case = solver.case.with_values(held(solver.config, values))
    other = GaitSolver(case)
    assert other.gait.structure == solver.gait.structure
    assert other.free == ()
    assert len(solver.free) == len(solver.walker.unknowns)


def test_tied_springs_are_one_number() -> None:
    place = "orthosis.stiffness_guess.dorsiflexion"
    solver = GaitSolver(load_case("mapd-orthosis", changes=(f"free={{{place}: [20, 90]}}",)))
    walker = solver.walker.with_parameters([11.0, 12.0, 33.0])
    assert walker.stiffness.tolist() == [33.0, 33.0, 11.0, 12.0]
