"""Metrics in closed form, tables there and back, figures with axes that say what they show."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.markers import TICKDOWN
from rich.console import Console

from conftest import MadeSolution
from figure_measure import complaints
from helpers import ACTIVATION, FRICTION, GAIT, STIFFNESS, stylised_series
from pathwalker_cli.conventions import CONTACT_FORCES, COORDINATES, GENERATORS, SIDES, STIFFNESSES
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.io.atomic import atomic_open, atomic_path
from pathwalker_cli.io.json_file import json_text, write_json
from pathwalker_cli.io.trajectory_csv import read_trajectory
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.results.tables import TABLES, controls_table, forces_table, torques_table
from pathwalker_cli.results.text import (
    _discretisation_text,
    solution_notes,
    spring_notes,
    summary,
    summary_renderable,
    summary_rows,
)
from pathwalker_cli.stride.figures import (
    FIGURES,
    Band,
    Reference,
    figure_names,
    make_figure,
    save_figures,
)
from pathwalker_cli.stride.figures.cycles import support_changes
from pathwalker_cli.stride.measures import ankle_torque_line, metrics_of
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import centre_of_pressure, own_cycle, stride_of

RANGES = {name: (5.0 if name.startswith("d") else 10.0, 92.0) for name in STIFFNESSES}


@pytest.fixture(scope="module")
def series() -> GaitSeries:
    return stylised_series("orthosis")


@pytest.fixture(scope="module")
def metrics(series: GaitSeries) -> dict[str, Any]:
    return metrics_of(stride_of(series))


def test_speed_time_and_cadence(metrics: dict[str, Any]) -> None:
    assert metrics["walking_speed"] == pytest.approx(GAIT.walking_speed)
    assert metrics["distance"] == pytest.approx(GAIT.stride_length)
    assert metrics["stride_time"] == pytest.approx(GAIT.stride_time)
    assert metrics["cadence"] == pytest.approx(2 * 60.0 / GAIT.stride_time)


def test_both_steps_of_a_symmetric_gait_are_half_the_stride(metrics: dict[str, Any]) -> None:
    for side in SIDES:
        # Legs differ by 5 mm, and the stylised gait plants a foot by 9 % of that elsewhere.
        assert metrics[f"step_length_{side}"] == pytest.approx(GAIT.stride_length / 2, abs=1e-3)
    assert sum(metrics[f"step_length_{side}"] for side in SIDES) == pytest.approx(
        metrics["distance"], abs=1e-6
    )


def test_shares_follow_from_the_phases(metrics: dict[str, Any]) -> None:
    double = GAIT.phase_shares[2] + GAIT.phase_shares[3]
    assert metrics["double_support_share"] == pytest.approx(double)
    for side in SIDES:
        assert metrics[f"stance_share_{side}"] == pytest.approx((1.0 + double) / 2)
        assert metrics[f"swing_share_{side}"] == pytest.approx((1.0 - double) / 2)
    assert list(metrics["phase_durations"].values()) == pytest.approx(GAIT.durations.tolist())


def test_crouch_is_the_least_knee_angle_of_stance(
    series: GaitSeries, metrics: dict[str, Any]
) -> None:
    for side in SIDES:
        knee, rows = series.column(f"knee_{side[0]}"), stride_of(series).stands(side)
        row = int(np.flatnonzero(series.time == metrics[f"min_stance_knee_flexion_time_{side}"])[0])
        assert rows[row]
        assert metrics[f"min_stance_knee_flexion_{side}"] == knee[row] == knee[rows].min()


def test_loads(series: GaitSeries, metrics: dict[str, Any]) -> None:
    weight = series.walker.weight
    for side in SIDES:
        assert metrics[f"peak_vertical_force_{side}"] == pytest.approx(weight)
        assert metrics[f"peak_vertical_force_{side}_body_weights"] == pytest.approx(1.0)
        assert 0.0 < metrics[f"max_friction_ratio_{side}"] <= FRICTION + 1e-9
    # Two points share the weight in the flat phases, three while a toe and a flat foot bear it.
    assert metrics["min_vertical_force"] == pytest.approx(weight / 3)


def test_effort_of_constant_activation(metrics: dict[str, Any]) -> None:
    effort = len(GENERATORS) * ACTIVATION**2 * GAIT.stride_time
    assert metrics["effort"] == pytest.approx(effort)
    assert metrics["effort_per_distance"] == pytest.approx(effort / GAIT.stride_length)
    assert set(metrics["peak_activation"].values()) == {ACTIVATION}


def test_quadrature_is_exact_for_its_polynomials(series: GaitSeries) -> None:
    weights, end = series.quadrature, series.duration
    for power in range(5):
        expected = end ** (power + 1) / (power + 1)
        assert weights @ series.time**power == pytest.approx(expected, rel=1e-12)


def test_an_elastic_orthosis_gives_back_what_it_took(metrics: dict[str, Any]) -> None:
    assert metrics["positive_orthosis_work"] > 0.1
    balance = metrics["positive_orthosis_work"] + metrics["negative_orthosis_work"]
    assert abs(balance) < 0.02 * metrics["positive_orthosis_work"]


def test_work_of_a_constant_torque_on_a_constant_speed(series: GaitSeries) -> None:
    v, muscle = np.zeros_like(series.v), np.zeros_like(series.muscle_torque)
    v[:, COORDINATES.index("lumbar")] = -2.0
    muscle[:, GENERATORS.index("lumbar_extension")] = 3.0
    forces = np.hstack([muscle, np.zeros((len(muscle), 2))])
    result = metrics_of(stride_of(replace(series, v=v, element_force=forces)))
    assert result["positive_muscle_work"] == 0.0
    assert result["negative_muscle_work"] == pytest.approx(-6.0 * GAIT.stride_time)
    assert result["peak_joint_moment"]["lumbar"] == pytest.approx(3.0)
    per_mass = result["peak_joint_moment_per_mass"]["lumbar"]
    assert per_mass == pytest.approx(3.0 / series.walker.total_mass)


def test_slope_of_a_linear_ankle(series: GaitSeries) -> None:
    torque = 4.0 - 80.0 * np.column_stack([series.column(name) for name in ("ankle_r", "ankle_l")])
    spring = replace(
        series,
        element_force=np.hstack([np.zeros_like(series.muscle_torque), torque]),
    )
    for side in SIDES:
        assert ankle_torque_line(stride_of(spring), side) == pytest.approx((80.0, 4.0))
        assert metrics_of(stride_of(spring))[f"ankle_torque_slope_{side}"] == pytest.approx(80.0)


def test_heights_below_the_ground_are_reported(series: GaitSeries) -> None:
    q = series.q.copy()
    lowest = series.contact_position[:, :, 1].min()
    q[:, COORDINATES.index("pelvis_tz")] -= 0.01 + lowest
    assert metrics_of(stride_of(replace(series, q=q)))["max_height_violation"] == pytest.approx(
        0.01
    )


def test_metrics_as_json(metrics: dict[str, Any]) -> None:
    flat = json.loads(json.dumps(metrics, allow_nan=False))
    values = [
        flat[f"{kind}_stiffness_{side}"]
        for kind in ("dorsiflexion", "plantarflexion")
        for side in SIDES
    ]
    assert values == STIFFNESS.tolist()
    assert flat["peak_vertical_force_left_body_weights"] == pytest.approx(1.0)
    assert flat["phase_durations"] == metrics["phase_durations"]
    assert set(flat["joint_range"]) == set(COORDINATES[2:])
    barefoot = metrics_of(stride_of(stylised_series("barefoot")))
    assert set(barefoot) == set(flat)
    assert all(barefoot[f"dorsiflexion_stiffness_{side}"] is None for side in SIDES)


def test_only_full_strides_have_metrics(series: GaitSeries) -> None:
    half = PhasedMotion(series.motion.phases[:4], series.motion.parameters)
    with pytest.raises(DataError, match="is no full stride"):
        stride_of(replace(series, motion=half))


@pytest.mark.parametrize("side", SIDES)
def test_own_cycle_begins_with_the_strike(series: GaitSeries, side: str) -> None:
    cycle = own_cycle(series, side)  # type: ignore[arg-type]
    assert cycle.percent[0] == 0.0
    assert cycle.percent[-1] == pytest.approx(100.0)
    assert np.all(np.diff(cycle.percent) >= -1e-12)
    bears = stride_of(series).stands(side)[cycle.index]  # type: ignore[arg-type]
    inside = np.abs(cycle.percent - cycle.toe_off) > 1e-9
    inside[[0, -1]] = False
    assert np.all(bears[inside] == (cycle.percent < cycle.toe_off)[inside])


def test_centre_of_pressure_lies_on_the_foot(series: GaitSeries) -> None:
    for side, heel in (("right", 0), ("left", 2)):
        x = centre_of_pressure(series, side)  # type: ignore[arg-type]
        rows = np.isfinite(x)
        assert np.all(rows == stride_of(series).stands(side))  # type: ignore[arg-type]
        assert np.all(x[rows] >= series.contact_position[rows, heel, 0] - 1e-12)
        assert np.all(x[rows] <= series.contact_position[rows, heel + 1, 0] + 1e-12)


def test_states_table(series: GaitSeries, tmp_path: Path) -> None:
    TABLES["states.csv"](tmp_path / "states.csv", series)
    with (tmp_path / "states.csv").open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:3] == ["time [s]", "phase", "pelvis_tx [m]"]
    assert {"hip_r [rad]", "hip_r_velocity [rad/s]", "hip_flexion_l_activation [1]"} < set(header)
    assert [row[1] for row in rows] == list(series.phase)
    values = np.array([[float(cell) for cell in (row[0], *row[2:])] for row in rows])
    expected = np.column_stack([series.time, series.q, series.v, series.activation])
    assert values == pytest.approx(expected, rel=1e-8, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("controls.csv", controls_table),
        ("forces.csv", forces_table),
        ("torques.csv", torques_table),
    ],
)
def test_tables_there_and_back(name: str, make, series: GaitSeries, tmp_path: Path) -> None:
    TABLES[name](tmp_path / name, series)
    back, table = read_trajectory(tmp_path / name, missing=True), make(series)
    assert (back.names, back.units) == (table.names, table.units)
    assert back.values == pytest.approx(table.values, rel=1e-8, abs=1e-12, nan_ok=True)


def test_sums_in_the_tables(series: GaitSeries) -> None:
    forces, torques = forces_table(series), torques_table(series)
    assert forces.names[:8] == CONTACT_FORCES
    assert forces["foot_r_z"] == pytest.approx(forces["heel_r_z"] + forces["toe_r_z"])
    parts = ("ankle_extension_l_torque", "ankle_flexion_l_torque", "orthosis_l_torque")
    assert torques["ankle_l_net_torque"] == pytest.approx(sum(torques[part] for part in parts))


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with atomic_open(path) as file:
        file.write("old")
    with pytest.raises(TypeError, match="int"), atomic_open(path) as file:
        file.writelines(["half of the new", 0])
    assert path.read_text(encoding="utf-8") == "old"
    with atomic_open(path, "wb") as file:
        file.write(b"new")
        assert path.read_text(encoding="utf-8") == "old"
    assert path.read_bytes() == b"new"
    with pytest.raises(FileNotFoundError), atomic_path(path):
        pass
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_json_has_no_numbers_that_are_none(tmp_path: Path) -> None:
    assert json_text({"Länge": [0.5, None]}) == '{\n  "Länge": [\n    0.5,\n    null\n  ]\n}\n'
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "file.json", {"length": float("nan")})
    assert list(tmp_path.iterdir()) == []


def reference(series: GaitSeries) -> Reference:
    percent = np.linspace(0.0, 100.0, 11)
    band = Band.over(percent, np.array([[0.1], [0.3]]) * np.ones(11))
    return Reference(angles={"hip_r": band, "lumbar_l": band}, forces={"foot_l_z": band})


OF_THIS_WALK = [name for name in FIGURES if name not in ("toe_joints", "cuffs")]
"""Figures of ten coordinates; those of toes and shells are in `test_toes` and `test_brace`."""


@pytest.mark.parametrize("name", OF_THIS_WALK)
def test_every_axis_says_what_it_shows(name: str, series: GaitSeries) -> None:
    figure = make_figure(name, series, reference(series))
    for ax in (ax for ax in figure.axes if ax.axison):
        below = [o for o in figure.axes if o.axison and same_column(o, ax) and is_below(o, ax)]
        beside = [o for o in figure.axes if o.axison and same_row(o, ax) and is_left(o, ax)]
        assert "[" in ax.get_xlabel() or below, ax.get_title()
        assert "[" in ax.get_ylabel() or beside, ax.get_title()


def same_column(a, b) -> bool:
    return a.get_subplotspec().colspan == b.get_subplotspec().colspan


def same_row(a, b) -> bool:
    return a.get_subplotspec().rowspan == b.get_subplotspec().rowspan


def is_below(a, b) -> bool:
    return a.get_subplotspec().rowspan.start > b.get_subplotspec().rowspan.start


def is_left(a, b) -> bool:
    return a.get_subplotspec().colspan.start < b.get_subplotspec().colspan.start


@pytest.mark.parametrize("name", OF_THIS_WALK)
def test_sides_differ_without_colour(name: str, series: GaitSeries) -> None:
    styles = {line.get_linestyle() for line in lines(make_figure(name, series))}
    assert {"-", "--"} <= styles


@pytest.mark.parametrize("name", OF_THIS_WALK)
def test_texts_can_be_read_beside_recordings(name: str, series: GaitSeries) -> None:
    assert complaints(make_figure(name, series, reference(series))) == []


def lines(figure: Figure) -> list:
    return [line for ax in figure.axes for line in ax.get_lines()]


def test_angles_are_clinical(series: GaitSeries) -> None:
    axes = {ax.get_title(): ax for ax in make_figure("joint_angles", series).axes}
    cycle = own_cycle(series, "right")
    curves = [np.asarray(line.get_ydata()) for line in axes["Hip"].get_lines()]
    expected = -np.rad2deg(series.column("hip_r")[cycle.index])
    assert any(curve.shape == expected.shape and np.allclose(curve, expected) for curve in curves)


def test_teeth_of_moments_are_marked_where_a_foot_changes_its_support(series: GaitSeries) -> None:
    stride, moments = stride_of(series), make_figure("joint_moments", series)
    apart = 100.0 * np.diff(stride.time).max() / stride.duration
    for side in SIDES:
        places = support_changes(stride, side)
        assert len(places) == 4, "heel and toe come down, heel and toe leave the ground"
        leaves = 100.0 * (stride.toe_off(side) - stride.strike(side)) / stride.duration
        assert np.abs(places - leaves).min() <= apart
        ticks = [line for line in moments.axes[0].lines if line.get_marker() == TICKDOWN]
        assert any(np.array_equal(line.get_xdata(), places) for line in ticks)


def test_figures_are_the_same_bytes_every_time(series: GaitSeries, tmp_path: Path) -> None:
    barefoot = stylised_series("barefoot")
    assert set(figure_names(series)) - set(figure_names(barefoot)) == {"orthosis_curves"}
    first, second = (save_figures(barefoot, tmp_path / name) for name in "ab")
    assert first == second
    assert {Path(name).suffix for name in first} == {".png", ".svg"}
    assert {entry.name for entry in (tmp_path / "a").iterdir()} == set(first)
    for name in first:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_barefoot_has_no_orthosis_curve() -> None:
    with pytest.raises(InputError, match="no orthosis curve"):
        make_figure("orthosis_curves", stylised_series("barefoot"))


def test_active_bounds_in_words(metrics: dict[str, Any]) -> None:
    flat = metrics | {"dorsiflexion_stiffness_right": 91.9998}
    assert spring_notes(flat, RANGES) == [
        "K_D right sits at its upper limit of 92 N m/rad: a stiffer one would cost less",
        "K_P right sits at its lower limit of 10 N m/rad: a softer one would cost less",
    ]
    assert spring_notes(metrics_of(stride_of(stylised_series("barefoot"))), RANGES) == []


def test_summary(metrics: dict[str, Any]) -> None:
    flat = metrics
    notes = spring_notes(flat, RANGES)
    text = summary(summary_rows(flat, "converged", 1.23456789), notes)
    for part in (
        "converged",
        "1.2346",
        "0.600 m/s",
        "right 0.330 m",
        "50.0 N m/rad (0.87 N m/deg)",
    ):
        assert part in text
    assert text.splitlines()[-1].startswith("note: K_P right sits at its lower limit")
    console = Console(file=StringIO(), width=120)
    console.print(summary_renderable(summary_rows(flat, "converged", 1.23456789), notes))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert "\x1b" not in shown
    assert [line.split() for line in shown.splitlines()] == [
        line.split() for line in text.splitlines()
    ]
    barefoot = metrics_of(stride_of(stylised_series("barefoot")))
    assert "K_D" not in summary(summary_rows(barefoot, "converged"))


def test_what_a_finer_mesh_changes_is_told_as_far_as_digits_show_it(
    made_solution: MadeSolution,
) -> None:
    errors = {
        "walking_speed": 4e-4,
        "min_stance_knee_flexion_left": 2e-3,
        "step_length_right": None,
    }
    text = _discretisation_text(made_solution(), errors)
    assert text == (
        "halving all mesh intervals would change the cost by about -0.2 %, "
        "least stance knee flexion, left by +0.11 deg"
    )


def test_equations_of_motion_that_are_met_only_roughly_are_a_note(
    made_solution: MadeSolution,
) -> None:
    solution, told = made_solution(), {}
    for residual in (1e-9, 0.36):
        solution.__dict__["second_engine"] = residual
        told[residual] = [note for note in solution_notes(solution) if "violated" in note]
    assert told[1e-9] == []
    assert "violated by up to 0.36 N or N m" in told[0.36][0]
