"""Work and momentum balance for a solved gait, and do not for one that was tampered with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pathwalker_cli.config import load_config, with_values
from pathwalker_cli.gait.solve import solve_study
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.series import GaitSeries


@pytest.fixture(scope="module")
def gait() -> GaitSeries:
    changes = {"mesh.intervals": 64, "mesh.refinements": 0}
    return solve_study(with_values(load_config("ls-barefoot"), changes)).series


def test_work_is_energy_and_impulse_is_momentum(gait: GaitSeries) -> None:
    found = balance(gait)
    assert found.energy < 1e-3 * found.work_scale
    assert found.contact_work < 1e-3 * found.work_scale
    assert found.impulse < 1e-5 * found.impulse_scale
    assert found.angular_impulse < 1e-5 * found.angular_scale
    assert abs(found.energy_change) > 10.0 * found.energy  # recorded strides are not periodic
    assert found.muscle_work == pytest.approx(found.energy_change, abs=2.0 * found.energy + 1e-2)


@pytest.mark.parametrize(
    ("column", "factor", "fails"),
    [
        ("force", 1.01, ("impulse", "angular_impulse")),
        ("element_force", 1.01, ("energy",)),
        ("v", 1.01, ("energy", "impulse")),
    ],
)
def test_wrong_numbers_break_a_balance(
    gait: GaitSeries, column: str, factor: float, fails: tuple[str, ...]
) -> None:
    before = balance(gait)
    wrong = replace(gait, **{column: factor * np.asarray(getattr(gait, column))})
    after = balance(wrong)
    for name in fails:
        assert getattr(after, name) > 3.0 * getattr(before, name), name


def test_a_force_at_the_wrong_foot_breaks_the_angular_balance(gait: GaitSeries) -> None:
    crossed = gait.force[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    before, after = balance(gait), balance(replace(gait, force=crossed))
    assert after.impulse == pytest.approx(before.impulse)
    assert after.angular_impulse > 100.0 * before.angular_impulse
