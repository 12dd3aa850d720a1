"""The command `uncertainty`: repeatable draws, honest counts, and what matters most."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from neighbours_stand_in import StandInOptimum, StandInResolver, stand_in_measures
from pathwalker_cli.case import load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies import neighbours
from pathwalker_cli.studies import uncertainty as module
from pathwalker_cli.studies.base import Work, base_run, load_study
from pathwalker_cli.studies.neighbours import Solved
from pathwalker_cli.studies.uncertainty import UncertaintyStudy, draw_cases, uncertainty
from pathwalker_cli.studies.uncertainty.draws import Distribution, Draws, Input, draw, inputs_of
from pathwalker_cli.studies.uncertainty.files import uncertainty_content
from pathwalker_cli.studies.uncertainty.result import (
    Spread,
    Uncertainty,
    chance_level,
    rank_correlations,
    span_text,
    span_words,
)

pytestmark = pytest.mark.usefixtures("sketched")

MadeSolution = Callable[..., GaitSolution]
PATIENT = load_patient("sreenivasa2017-patient")


# Distributions and draws


def drawn(count: int = 4000, **changes: Any) -> np.ndarray:
    """Return draws of one input."""
    single = Input("body_mass", Distribution(**changes))
    return draw((single,), count, 1).values[:, 0]


def test_normal_draws_have_mean_and_spread_and_end_at_three() -> None:
    factors = drawn(kind="normal", relative=0.1)
    assert factors.mean() == pytest.approx(1.0, abs=1e-3)
    assert factors.std() == pytest.approx(0.1 * 0.98658, rel=1e-3), "truncated at three"
    assert np.abs(factors - 1.0).max() <= 0.3
    shifts = drawn(kind="normal", absolute=0.02)
    assert shifts.mean() == pytest.approx(0.0, abs=1e-4)
    assert shifts.std() == pytest.approx(0.02 * 0.98658, rel=1e-3)


def test_uniform_draws_fill_their_width() -> None:
    shifts = drawn(kind="uniform", absolute=0.03)
    assert np.abs(shifts).max() == pytest.approx(0.03, rel=1e-3)
    assert shifts.std() == pytest.approx(0.03 / np.sqrt(3.0), rel=1e-3)


def test_lognormal_draws_are_factors_with_median_one() -> None:
    factors = drawn(kind="lognormal", relative=0.5)
    assert np.median(factors) == pytest.approx(1.0, rel=1e-3)
    assert np.log(factors).std() == pytest.approx(0.5 * 0.98658, rel=1e-3)
    assert factors.min() > 0.0


def test_equal_seeds_give_equal_draws_evenly_spread() -> None:
    flat = Distribution(kind="uniform", absolute=0.01)
    pair = (Input("body_mass", Distribution(relative=0.03)), Input("orthosis.neutral_angle", flat))
    one, same, other = (draw(pair, 20, seed).values for seed in (3, 3, 4))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)
    cells = np.floor((one[:, 1] / 0.01 + 1.0) * 10.0)
    assert sorted(cells) == list(range(20)), "one draw in every twentieth"


def test_each_draws_every_number_for_itself_and_otherwise_all_together() -> None:
    each = inputs_of({"strengths": Distribution(relative=0.1, each=True)}, PATIENT)
    assert len(each) == 14
    assert {"strengths.hip_flexion.left", "strengths.lumbar_flexion"} <= {i.place for i in each}
    common = inputs_of({"strengths": Distribution(relative=0.1)}, PATIENT)
    assert [entry.place for entry in common] == ["strengths"]
    ranges = inputs_of({"recorded.barefoot.joint_ranges": Distribution(absolute=0.03, each=True)},
                       PATIENT)  # fmt: skip
    assert len(ranges) == 8, "both ends of a range stay together"


def test_lengths_left_to_proportions_can_be_drawn() -> None:
    lengths = PATIENT.segment_lengths.model_copy(update={"thigh": None})
    bare = PATIENT.model_copy(update={"segment_lengths": lengths})
    found = inputs_of({"segment_lengths.thigh": Distribution(relative=0.02, each=True)}, bare)
    assert [entry.place for entry in found] == [
        "segment_lengths.thigh.right", "segment_lengths.thigh.left",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("quantities", "words"),
    [
        ({"strenghts": {"relative": 0.1}}, "did you mean 'strengths'?"),
        ({"strengths.hip": {"relative": 0.1}}, "quantities.strengths.hip"),
        ({"id": {"relative": 0.1}}, "has no 'id'"),
        (
            {"strengths": {"relative": 0.1, "each": True},
             "strengths.lumbar_flexion": {"relative": 0.2}},
            "draws strengths.lumbar_flexion twice",
        ),
    ],
)  # fmt: skip
def test_places_that_do_not_exist_are_refused(
    quantities: dict[str, dict[str, Any]], words: str
) -> None:
    given = {place: Distribution(**entry) for place, entry in quantities.items()}
    with pytest.raises(ConfigError, match=words.replace("?", r"\?")):
        inputs_of(given, PATIENT)


def test_a_draw_comes_on_top_of_what_the_base_varies() -> None:
    case = load_case("mapd-orthosis").with_values({"variation.scale": {"body_mass": 1.1}})
    draws = Draws((Input("body_mass", Distribution(relative=0.1)),), np.array([[0.9], [1.05]]))
    masses = [each.patient.body_mass / PATIENT.body_mass for each in draw_cases(case, draws)]
    assert masses == pytest.approx([0.99, 1.155])


# Statistics


def test_rank_correlations_find_monotonous_and_no_relations() -> None:
    x = np.random.default_rng(0).uniform(size=(200, 3))
    found = rank_correlations(x, np.exp(5.0 * x[:, 1]))
    assert found[1] == pytest.approx(1.0)
    assert np.abs(found[[0, 2]]).max() < 0.2
    assert np.isnan(rank_correlations(x, np.full(200, 92.0))).all()


def test_chance_level_is_exceeded_by_idle_inputs_in_five_of_a_hundred_studies() -> None:
    rng, level = np.random.default_rng(1), chance_level(60, 10)
    strongest = [
        np.abs(rank_correlations(rng.uniform(size=(60, 10)), rng.uniform(size=60))).max()
        for _ in range(400)
    ]
    assert 0.02 < np.mean(np.array(strongest) > level) < 0.09


# The command


@pytest.fixture
def resolver(monkeypatch: pytest.MonkeyPatch) -> StandInResolver:
    stand_in = StandInResolver(load_case("mapd-orthosis"))
    for place in (module, neighbours):
        monkeypatch.setattr(place, "resolver_of", lambda run, tolerance: stand_in)
        monkeypatch.setattr(place, "measures", stand_in_measures)
    return stand_in


@pytest.fixture
def call(made_runs: Path, resolver: StandInResolver, tmp_path: Path) -> Callable[..., Result]:
    study = tmp_path / "study.yaml"
    study.write_text(
        "base: mapd-orthosis\ndraws: 20\nquantities:\n"
        "  strengths: {relative: 0.1}\n  body_mass: {relative: 0.03}\n"
        "  orthosis.neutral_angle: {kind: uniform, absolute: 0.01}\n",
        encoding="utf-8",
    )

    def run(*words: object) -> Result:
        options = [
            "--run",
            made_runs / "mapd-orthosis",
            "--out",
            tmp_path / "out",
            "--workers",
            1,
            *words,
        ]
        return CliRunner().invoke(cli, ["uncertainty", str(study), *map(str, options)])

    return run


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.drawn
def test_the_command_tells_spreads_limits_and_what_matters(
    call: Callable[..., Result], resolver: StandInResolver, tmp_path: Path
) -> None:
    result = call()
    assert result.exit_code == 0, result.output
    assert "20 draws of 3 inputs, 20 converged" in result.output
    assert "K_D right: at its lower limit of 5 N m/rad in 0 % of the draws" in result.output
    assert "in 100 % of the draws, at its upper one of 92 in 0 %" in result.output, "K_P left"
    rows = {row["measure"]: row for row in table(tmp_path / "out" / "uncertainty.csv")}
    assert rows["cost"]["strongest input"] == "strengths"
    assert float(rows["cost"]["rank correlation [1]"]) == pytest.approx(-1.0)
    assert rows["walking_speed"]["strongest input"] == "body_mass"
    assert rows["step_length_left"]["strongest input"] == ""
    assert rows["dorsiflexion_stiffness_right"]["share at upper limit [1]"] == "1"
    assert rows["cost"]["share at upper limit [1]"] == ""
    cost = [float(row["cost [1]"]) for row in table(tmp_path / "out" / "draws.csv")]
    for name, q in (("quantile 0.05", 0.05), ("median", 0.5), ("quantile 0.95", 0.95)):
        assert float(rows["cost"][name]) == pytest.approx(np.quantile(cost, q), rel=1e-6)
    assert len(table(tmp_path / "out" / "correlations.csv")) == 3
    for name in ("uncertainty.png", "uncertainty.svg", "correlations.png", "correlations.svg"):
        assert (tmp_path / "out" / "figures" / name).stat().st_size > 1000
    assert len(resolver.solved) == 20


def test_every_draw_can_be_solved_again_from_its_row(
    call: Callable[..., Result], resolver: StandInResolver, tmp_path: Path
) -> None:
    call()
    for row, solved in zip(table(tmp_path / "out" / "draws.csv"), resolver.solved, strict=True):
        again = load_config("mapd-orthosis", changes=(f"variation={row['variation']}",))
        assert again.variation == solved.config.variation
        assert float(row["strengths [factor]"]) == solved.config.variation.scale["strengths"]
        assert json.loads(row["variation"])["shift"].keys() == {"orthosis.neutral_angle"}


def test_failed_draws_are_counted_and_told(
    call: Callable[..., Result], resolver: StandInResolver, tmp_path: Path
) -> None:
    resolver.fails = lambda config: config.variation.scale["strengths"] < 0.9
    result = call()
    assert result.exit_code == 1
    rows = table(tmp_path / "out" / "draws.csv")
    failed = [row for row in rows if row["status"] != "converged"]
    assert 0 < len(failed) < 10
    assert all(float(row["strengths [factor]"]) < 0.9 and row["cost [1]"] == "" for row in failed)
    assert f"{len(failed)} draws (" in result.output
    assert f"draw {failed[0]['draw']}: the iteration limit was reached; strengths x 0." in (
        result.output
    )
    assert f"{len(failed)} of 20 draws did not converge" in result.output
    assert table(tmp_path / "out" / "uncertainty.csv")[0]["draws [1]"] == str(20 - len(failed))


def test_all_draws_may_fail(call: Callable[..., Result], resolver: StandInResolver) -> None:
    resolver.fails = lambda config: True
    result = call()
    assert result.exit_code == 1
    assert "20 draws of 3 inputs, 0 converged" in result.output
    assert "nan" not in result.output


def test_a_killed_study_goes_on_where_it_was(
    call: Callable[..., Result],
    resolver: StandInResolver,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve = resolver.resolve

    def dying(case: Any, start: Any = None, insist: bool = True) -> StandInOptimum:
        if len(resolver.solved) == 7:
            raise KeyboardInterrupt
        return solve(case, start, insist)

    monkeypatch.setattr(resolver, "resolve", dying)
    assert call().exit_code != 0
    assert len(list((tmp_path / "out" / "draws").iterdir())) == 7
    monkeypatch.setattr(resolver, "resolve", solve)
    resolver.solved.clear()
    result = call()
    assert result.exit_code == 0
    assert len(resolver.solved) == 13
    assert "7 were there already" in result.output
    whole = (tmp_path / "out" / "draws.csv").read_text(encoding="utf-8")
    call("--out", tmp_path / "anew")
    assert (tmp_path / "anew" / "draws.csv").read_text(encoding="utf-8") == whole


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("quantities={strenghts: {relative: 0.1}}",), "did you mean 'strengths'?"),
        (("quantities={}",), "quantities"),
        (("quantities={strengths: {relative: 0.1, absolute: 1.0}}",), "one of the two"),
        (("quantities={strengths: {each: true}}",), "neither relative nor absolute"),
        (("quantities={strengths: {kind: lognormal, absolute: 1.0}}",), "it is one of factors"),
        (("quantities={strengths: {relative: 0.5}}",), "factors stay positive"),
        (("quantities={strengths: {kind: beta, relative: 0.1}}",), "lognormal"),
        (("quantities={orthosis.neutral_angle: {absolute: 0.1}}",), "gives a patient who is"),
        (("draws=1",), "draws"),
        (("set={bounds.friction: 0.7}",), "--run"),
    ],
)
def test_refusals(call: Callable[..., Result], words: tuple[str, ...], message: str) -> None:
    result = call(*[part for word in words for part in ("--set", word)])
    assert result.exit_code == 2, result.output
    assert message in result.output
    assert len(result.output.splitlines()) == 1


def test_shipped_config_fits_the_shipped_patient() -> None:
    study = load_study("uncertainty", UncertaintyStudy)
    inputs = inputs_of(study.quantities, PATIENT)
    cases = draw_cases(load_case("mapd-orthosis"), draw(inputs, study.draws, study.seed))
    assert len(cases) == 100


@pytest.mark.slow
def test_real_draws_do_not_depend_on_the_number_of_processes(tmp_path: Path) -> None:
    coarse = {"mesh.intervals": 16, "mesh.refinements": 0, "solver.first_tolerance": 1e-6}
    run = base_run(load_case("mapd-orthosis").with_values(coarse), tmp_path / "base")
    quantities = {
        "strengths": Distribution(relative=0.05),
        "body_mass": Distribution(relative=0.02),
    }
    study = UncertaintyStudy(base="x", draws=4, quantities=quantities)
    one = uncertainty(study, run, Work(tmp_path / "one", workers=1))
    two = uncertainty(study, run, Work(tmp_path / "two", workers=2))
    assert not one.failed
    for a, b in zip(one.solved, two.solved, strict=True):
        assert a.values == pytest.approx(b.values, rel=1e-9)
    found = {spread.measure.key: spread for spread in one.spreads}
    assert found["cost"].quantiles[0] < found["cost"].quantiles[2]
    for name in STIFFNESSES:
        low, high = one.ranges[name]
        assert all(low <= value <= high for value in one.values(name))


# Learnt numbers


def test_learnt_numbers_are_drawn_as_they_go_together() -> None:
    learnt = load_config("predict-orthosis").learnt
    assert learnt is not None
    draws = draw((), 200, 3, learnt)
    assert [entry.place for entry in draws.inputs] == list(learnt.numbers)
    numbers = list(learnt.numbers.values())
    deviations = np.array(
        [[n.deviations(x) for n, x in zip(numbers, row, strict=True)] for row in draws.values]
    )
    spread = np.corrcoef(deviations.T)
    wanted = np.array(learnt.covariance)
    sizes = np.sqrt(np.diag(wanted))
    strong = np.abs(wanted / np.outer(sizes, sizes)) > 0.5
    assert spread[strong] == pytest.approx((wanted / np.outer(sizes, sizes))[strong], abs=0.15)
    assert draws.variation(0).scale == draws.variation(0).shift == {}
    assert draws.learnt(0).keys() == learnt.numbers.keys()


def test_a_base_without_learnt_numbers_is_refused() -> None:
    words = ["uncertainty", "uncertainty", "--set", "learnt=true"]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    assert "has no learnt numbers" in result.output


@pytest.mark.parametrize(
    ("k_d", "words"),
    [
        (np.linspace(5.0, 92.0, 20), "not determined by what was learnt"),
        (np.linspace(40.0, 44.0, 20), ": determined by what was learnt"),
        (np.r_[np.full(15, 5.0), np.linspace(6.0, 9.0, 5)], "held by its limit, not determined"),
    ],
)
def test_what_was_learnt_says_which_springs_it_leaves_open(k_d: np.ndarray, words: str) -> None:
    config = load_config("predict-orthosis")
    assert config.learnt is not None
    draws = draw((), 20, 0, config.learnt)
    keys = [measure.key for measure in measures_in("studies")]
    base = dict.fromkeys(keys, 1.0)
    solved = tuple(
        Solved(f"draw-{i:05d}", "converged", {**base, STIFFNESSES[0]: float(x)}, 9, 0.1, False)
        for i, x in enumerate(k_d)
    )
    ranges = dict.fromkeys(STIFFNESSES, (1.0, 1.0)) | {STIFFNESSES[0]: (5.0, 92.0)}
    shown = measures_in("studies")
    result = Uncertainty(config, "made", 42, base, ranges, shown, {}, draws, solved, 1.0, 1)
    (advice,) = uncertainty_content(result)["advice"]
    assert words in advice
    assert "cost." not in advice


def test_the_one_measurement_is_what_both_springs_follow_most() -> None:
    """K_D right follows a, K_D left b, both follow c and the cost d more than either."""
    rng = np.random.default_rng(2)
    places = ("tissue.damping", "tissue.hip_stiffness.right", "tissue.knee_stiffness.left",
              "cost.goals.time")  # fmt: skip
    a, b, c, d = drawn = rng.standard_normal((4, 60))
    k_d = 50.0 + 2.0 * a + 3.0 * c + 9.0 * d, 50.0 + 2.0 * b + 3.0 * c + 9.0 * d
    base = dict.fromkeys([measure.key for measure in measures_in("studies")], 1.0)
    names = [name for name in STIFFNESSES if name.startswith("dorsiflexion")]
    solved = tuple(
        Solved(
            f"draw-{i:05d}", "converged", {**base, names[0]: right, names[1]: left}, 9, 0.1, False
        )
        for i, (right, left) in enumerate(zip(*k_d, strict=True))
    )
    ranges = dict.fromkeys(STIFFNESSES, (1.0, 1.0)) | dict.fromkeys(names, (5.0, 92.0))
    draws = Draws(tuple(map(Input, places)), drawn.T)
    about = load_config("predict-orthosis"), "made", 42, base, ranges, measures_in("studies"), {}
    content = uncertainty_content(Uncertainty(*about, draws, solved, 1.0, 1))
    first = content["measure_first"]
    assert first["place"] == "tissue.knee_stiffness.left"
    ranked = [rank_correlations(drawn[2:3].T, k)[0] for k in k_d]
    assert first["share"] == pytest.approx(np.mean(np.square(ranked)))
    assert len(content["advice"]) == 3
    assert "tissue.knee_stiffness.left would narrow K_D most" in content["advice"][-1]
    prescribed = Uncertainty(*about[:4], dict.fromkeys(STIFFNESSES, (1.0, 1.0)), *about[5:],
                             draws, solved, 1.0, 1)  # fmt: skip
    assert uncertainty_content(prescribed)["measure_first"] is None


def spread_of(values: np.ndarray) -> Spread:
    measure = next(m for m in measures_in("studies") if m.key == STIFFNESSES[0])
    quantiles = tuple(np.quantile(values, (0.05, 0.5, 0.95)).tolist())
    return Spread(measure, 50.0, quantiles, 0.0, 1.0, np.zeros(1), None)


def test_few_draws_have_no_tails_and_a_limit_is_no_range() -> None:
    few, many = np.linspace(10.0, 60.0, 6), np.linspace(10.0, 60.0, 101)
    assert span_words(6) == "range of 6"
    assert span_text(spread_of(few), few, (5.0, 90.0)) == "10.0 to 60.0"
    assert span_words(101) == "90 % of draws"
    assert span_text(spread_of(many), many, (5.0, 90.0)) == "12.5 to 57.5"
    stuck = np.full(30, 90.0)
    assert span_text(spread_of(stuck), stuck, (5.0, 90.0)) == "all at upper limit"
    assert span_text(spread_of(stuck), stuck, (90.0, 90.0)) == "90.0 to 90.0", "prescribed"
