"""What is said of an identified stiffness: regions, limits, stops, optima and real springs."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from conftest import MadeSolution
from helpers import stylised_series
from pathwalker_cli.case import load_case
from pathwalker_cli.config import load_config, smoke_version
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import PatientError
from pathwalker_cli.gait.solution import LocalOptimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.yaml_file import validate
from pathwalker_cli.patient import load_patient
from pathwalker_cli.patient.blocks import RealSpring, SpringSet
from pathwalker_cli.studies.verdict import (
    LOADED,
    SHARE,
    NumberVerdict,
    SnappedSprings,
    StifferStops,
    StopVerdict,
    Verdict,
    verdict_of_metrics,
)
from pathwalker_cli.studies.verdict.judge import _nearest, _quadratic_edge, _stops, verdict_of
from pathwalker_cli.studies.verdict.words import stop_sentence, stop_warnings, verdict_lines

INSIDE = NumberVerdict(
    "plantarflexion_stiffness_right", "K_P right", "N m/rad", 20.0,
    (5.0, 92.0), "", 0.0, 1e-4, (15.0, 30.0),
    (False, False), True,
)  # fmt: skip
AT_LIMIT = NumberVerdict(
    "dorsiflexion_stiffness_left", "K_D left", "N m/rad", 92.0,
    (5.0, 92.0), "upper", -2e-3, 1e-5, (60.0, 92.0),
    (False, True), True,
)  # fmt: skip
PRESCRIBED = NumberVerdict(
    "dorsiflexion_stiffness_right", "K_D right", "N m/rad", 40.0,
    (40.0, 40.0), "", 0.0, 0.0, (40.0, 40.0), (True, True), True,
)  # fmt: skip
OPTIMUM = LocalOptimum(0, "synthetic", "converged", 0.25, 0.64, (40.0, 92.0, 20.0, 6.0), 10, 1.0)


def verdict(**changes: object) -> Verdict:
    """Return a verdict."""
    made = Verdict((INSIDE, AT_LIMIT), (), (), None, (), 0, 7, 3.0)
    return replace(made, **changes)  # type: ignore[arg-type]


def text(made: Verdict) -> dict[str, str]:
    """Return the lines by label."""
    return dict(verdict_lines(made))


def test_a_verdict_on_learnt_numbers_names_what_tells_their_spread() -> None:
    learnt = load_config("predict-orthosis").learnt
    assert learnt is not None
    said = dict(verdict_lines(verdict(), learnt, "runs/mine"))["learnt numbers"]
    assert f"{len(learnt.numbers)} numbers learnt from barefoot strides" in said
    assert said.endswith('uncertainty uncertainty-learnt --run runs/mine --set "set={}"')
    assert "learnt numbers" not in text(verdict())


@pytest.mark.parametrize(
    ("region", "words"),
    [((15.0, 30.0), "determined"), ((10.0, 60.0), "roughly determined"),
     ((5.0, 92.0), "not determined")],
)  # fmt: skip
def test_the_width_of_the_region_decides_the_words(region: tuple[float, float], words: str) -> None:
    assert replace(INSIDE, region=region).determined == words


def test_real_springs_are_taken_from_the_range_where_it_holds_any() -> None:
    springs = [RealSpring(name=f"{k:g}", stiffness=k) for k in (5.0, 40.0, 92.0)]
    assert [spring.name for spring in _nearest(springs, 20.0, (20.0, 150.0))] == ["40", "92"]
    assert _nearest(springs, 120.0, (100.0, 150.0))[0].name == "92"


@pytest.mark.parametrize(
    ("region", "words"), [((60.0, 92.0), "set by its limit"), ((5.0, 92.0), "not determined")]
)
def test_a_spring_at_its_limit_is_not_called_determined(
    region: tuple[float, float], words: str
) -> None:
    assert replace(INSIDE, region=region, limit="upper").determined == words


def test_stiffness_is_told_per_radian_and_per_degree() -> None:
    line = text(verdict())["K_P right"]
    assert "20.0 N m/rad (0.35 N m/deg)" in line
    assert "from 15.0 to 30.0 N m/rad (0.26 to 0.52 N m/deg)" in line
    assert "17 % of the springs" in line


def test_a_limit_says_what_lies_beyond_it() -> None:
    line = text(verdict())["K_D left"]
    assert "sits at the upper limit: 9.2 N m/rad stiffer would save about 1.8 % more" in line
    soft = replace(AT_LIMIT, limit="lower", gradient=2e-3, value=5.0, region=(5.0, 9.0))
    line = text(verdict(springs=(soft,)))["K_D left"]
    assert "sits at the lower limit: 0.5 N m/rad softer would save about 0.1 % more" in line


def test_a_prescribed_spring_is_not_judged() -> None:
    """Whatever else is known of it: it can sit at no limit."""
    for spring in (PRESCRIBED, replace(PRESCRIBED, limit="upper", certain=False)):
        line = text(verdict(springs=(spring, AT_LIMIT)))["K_D right"]
        assert line == "40.0 N m/rad (0.70 N m/deg): prescribed by the config, not identified"
    assert PRESCRIBED.determined == "prescribed"
    others = replace(OPTIMUM, stiffness=(40.0, 70.0, 20.0, 6.0))
    made = verdict(springs=(PRESCRIBED, AT_LIMIT), optima=(OPTIMUM, others), starts=2)
    assert text(made)["other optima"].endswith("with K_D left 70 to 92 N m/rad")


def test_uncertain_ends_are_admitted() -> None:
    line = text(verdict(springs=(replace(INSIDE, certain=False),)))["K_P right"]
    assert "not certain" in line


def test_another_optimum_at_a_limit_is_told() -> None:
    far = replace(INSIDE, again=(False, True))
    assert far.determined == "not determined"
    assert "as good again at 92.0 N m/rad" in text(verdict(springs=(far,)))["K_P right"]


def test_stops_that_are_reached_are_named() -> None:
    assert text(verdict())["hard stops"] == "none is reached"
    stop = StopVerdict("right", "dorsiflexion", -0.13, 0.05, 0.4)
    away = StopVerdict("left", "dorsiflexion", -0.13, -0.01, 0.0)
    line = text(verdict(stops=(stop, away)))["hard stops"]
    assert line == "right dorsiflexion stop (7.4 deg) exceeded by 2.9 deg, 40 % of the stride"
    assert not list(stop_warnings(verdict(stops=(stop, away))))


def test_stops_that_carry_much_are_a_warning() -> None:
    changes = {"cost": -0.0131, STIFFNESSES[0]: -3.04, "step_length_left": 0.012,
               "step_length_right": 1e-5}  # fmt: skip
    stop = StopVerdict("right", "dorsiflexion", -0.13, 0.05, 0.4, 10.0, 0.62, 200.0, changes)
    light = replace(stop, stop="plantarflexion", carried=LOADED / 2, stiffer={})
    lines = list(verdict_lines(verdict(springs=(PRESCRIBED,), stops=(stop, light))))
    told = dict(lines)["hard stops"]
    assert ", 40 % of the stride, by up to 10.0 N m (62 % of the impulse)" in told
    carried, moved = (text for label, text in lines if not label)
    assert carried.startswith("WARNING: hard stops carry much")
    assert "right dorsiflexion stop 62 %;" in carried
    assert "plantarflexion" not in carried
    assert moved.endswith(
        "to first order: right dorsiflexion stop cost -1.3 %, K_D right -3 N m/rad, "
        "step length, left +0.012 m"
    )
    for twice, end in (
        (
            StifferStops(2.0, "converged", changes),
            "solved again: cost -1.3 %, K_D right -3 N m/rad",
        ),
        (StifferStops(2.0, "iteration limit", {}), "these stops: iteration limit"),
    ):
        found = verdict(springs=(PRESCRIBED,), stops=(stop,), stiffer_stops=twice)
        *_, last = stop_warnings(found)
        assert end in last
        assert stop_sentence(found).endswith(f"measure it (orthosis.stop_stiffness); {last}")
    assert stop_sentence(verdict()) == ""


def test_verdicts_of_older_runs_know_nothing_of_stops() -> None:
    stop = StopVerdict("left", "dorsiflexion", -0.1, 0.1, 0.5)
    plain = json.loads(json.dumps(verdict(stops=(stop,)).as_dict()))
    del plain["stiffer_stops"]
    for key in ("torque", "carried", "stiffness", "stiffer"):
        del plain["stops"][0][key]
    found = verdict_of_metrics({"verdict": plain})
    assert found is not None
    assert not list(stop_warnings(found))


def test_stops_are_measured_on_the_stride() -> None:
    series = stylised_series()
    fixed = series.walker.orthosis
    found = {(stop.side, stop.stop): stop for stop in _stops(series)}
    ankle = series.column("ankle_r")
    expected = fixed["right"].dorsiflexion_stop - ankle.min()
    assert found["right", "dorsiflexion"].excess == pytest.approx(expected)
    assert (found["right", "dorsiflexion"].share > 0.0) == (expected > 0.0)
    for stop in found.values():
        # beyond the bend of the curve, a stop takes what exceeds the torque of the bent spring
        if stop.excess > 0.03:
            assert stop.torque == pytest.approx(stop.stiffness * stop.excess, rel=1e-6)
        assert (stop.carried > 0.0) == (stop.excess > 0.0)
        assert stop.carried < 1.0
    assert max(stop.excess for stop in found.values()) > 0.03


def test_other_optima_are_counted_with_their_springs() -> None:
    assert "starts: 8" in text(verdict())["other optima"]
    other = replace(OPTIMUM, start=1, stiffness=(40.0, 91.0, 80.0, 6.0))
    line = text(verdict(optima=(OPTIMUM, other), starts=4))["other optima"]
    assert line.startswith("1 of 3 other starts end within 5 %")
    assert "K_P right 20 to 80" in line


def test_real_springs_and_their_price() -> None:
    assert "lists none" in text(verdict())["real springs"]
    name = INSIDE.name
    snapped = SnappedSprings({name: "flexible"}, {name: 40.1}, 0.012, 0.64, "converged")
    line = text(verdict(snapped=snapped))["real springs"]
    assert line == "K_P right flexible (40.1 N m/rad, 0.70 N m/deg): cost +1.2 %, 0.640 m/s"
    failed = replace(snapped, status="the iteration limit was reached")
    assert "estimated cost" in text(verdict(snapped=failed))["real springs"]


def test_a_verdict_is_plain_values() -> None:
    plain = json.loads(json.dumps(verdict().as_dict()))
    assert plain["springs"][0]["determined"] == "determined"
    assert plain["springs"][0]["region"] == [15.0, 30.0]


@pytest.mark.parametrize("slope", [0.0, 1e-3, -1e-3])
def test_the_quadratic_edge_meets_the_share(slope: float) -> None:
    edge = _quadratic_edge(slope, 1e-4)
    slope = max(slope, 0.0)
    assert slope * edge + 1e-4 * edge**2 / 2.0 == pytest.approx(SHARE)
    assert np.isfinite(_quadratic_edge(0.0, -1.0))


def test_there_is_no_verdict_without_springs(made_solution: MadeSolution) -> None:
    assert verdict_of(made_solution("mapd-barefoot")) is None


def test_there_is_no_verdict_on_what_did_not_converge(made_solution: MadeSolution) -> None:
    assert verdict_of(made_solution(status="the iteration limit was reached")) is None


def test_smoke_runs_are_not_judged() -> None:
    assert load_config("mapd-orthosis").verdict
    assert not smoke_version(load_config("mapd-orthosis")).verdict


@pytest.mark.parametrize(
    ("springs", "words"),
    [([], "at least 1"), ([{"name": "a", "stiffness": 0.7}], "N m per degree"),
     ([{"name": "a", "stiffness": 40.0}, {"name": "a", "stiffness": 50.0}], "twice")],
)  # fmt: skip
def test_a_wrong_list_of_springs_is_refused(springs: list[object], words: str) -> None:
    mapping = {"dorsiflexion": springs, "plantarflexion": springs, "source": "a catalogue"}
    with pytest.raises(PatientError, match=words):
        validate(mapping, SpringSet, error=PatientError)


def test_the_shipped_springs_lie_in_their_range() -> None:
    worn = load_patient("sreenivasa2017-patient").require_orthosis()
    assert worn.springs is not None
    for kind in ("dorsiflexion", "plantarflexion"):
        low, high = getattr(worn.stiffness_range, kind)["right"]
        assert all(low <= spring.stiffness <= high for spring in getattr(worn.springs, kind))


@pytest.mark.slow
def test_a_real_verdict_encloses_the_identified_springs() -> None:
    coarse = {"mesh.intervals": 24, "mesh.refinements": 0}
    solution = GaitSolver(load_case("mapd-orthosis").with_values(coarse)).solve()
    found = verdict_of(solution)
    assert found is not None
    for spring in found.springs:
        low, high = spring.region
        assert low - 1e-3 <= spring.value <= high + 1e-3
        assert spring.certain
    assert found.snapped is not None
    assert found.snapped.status == "converged"
    assert found.snapped.rise > -1e-3


def test_real_springs_that_cost_less_than_the_optimum_are_a_warning() -> None:
    name = INSIDE.name
    snapped = SnappedSprings({name: "flexible"}, {name: 40.1}, -0.026, 0.64, "converged")
    line = text(verdict(snapped=snapped))["real springs"]
    assert "WARNING: that is less than the optimum found" in line
    for near in (-1e-4, 0.04):
        line = text(verdict(snapped=replace(snapped, rise=near)))["real springs"]
        assert "WARNING" not in line
    far = replace(snapped, rise=0.94)
    assert "WARNING: 94 % above the springs found" in text(verdict(snapped=far))["real springs"]


def test_other_numbers_are_told_in_degrees_with_their_direction() -> None:
    angle = NumberVerdict(
        "neutral_angle", "neutral angle", "rad", 0.04, (-0.06, 0.04), "upper", -4.0, 1e-2,
        (0.03, 0.04), (False, True), True, tied=True,
    )  # fmt: skip
    play = replace(angle, name="free_play_left", label="free play left", value=0.02, limit="")
    lines = text(verdict(numbers=(angle, play)))
    assert "2.3 deg plantarflexion: set by its limit" in lines["neutral angle"]
    assert "from 1.7 deg plantarflexion to 2.3 deg plantarflexion" in lines["neutral angle"]
    assert "both sides are one number" in lines["neutral angle"]
    assert "1.0 deg towards plantarflexion would save about 7 % more" in lines["neutral angle"]
    assert lines["free play left"].startswith("1.1 deg: ")
    content = json.loads(json.dumps(verdict(numbers=(angle,)).as_dict()))
    again = verdict_of_metrics({"verdict": content})
    assert again is not None
    assert again.numbers == (angle,)
