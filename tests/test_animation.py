"""Animations: the drawn stride, the page, films, the view in 3D, and what is refused."""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from helpers import GAIT, stylised_series, walker_of
from made_c3d import motion, write_c3d
from pathwalker_cli.animation.drawing import (
    Drawing,
    common_view,
    drawing,
    force_scale,
    words,
)
from pathwalker_cli.animation.film import film_rate
from pathwalker_cli.animation.frames import GaitFrames, gait_frames
from pathwalker_cli.animation.html import html_page
from pathwalker_cli.animation.look import pace
from pathwalker_cli.animation.recorded import recorded_frames
from pathwalker_cli.animation.viewer import poses, walker_geometry
from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import GENERATORS, SIDES, SUFFIX
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.model.contact import PHASES, phase_named
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.stride.stride import body_points

MadeSolution = Callable[..., GaitSolution]
HOSTILE = "<!--<script><img src=x onerror=alert(1)>"
COUNT = 110
SPREAD = 2.0e-3
"""How far a foot of the stylised gait strays from the ground that it stands on [m]."""


@pytest.fixture(scope="module")
def frames() -> GaitFrames:
    return gait_frames(stylised_series("orthosis"), "worn", "mapd-orthosis", COUNT)


@pytest.fixture(scope="module")
def drawn(frames: GaitFrames) -> Drawing:
    return drawing(frames)


@pytest.fixture(scope="module")
def runs(made_solution: MadeSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of runs, named after their problems; `broken` did not converge."""
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
        for problem in ("mapd-barefoot", "mapd-orthosis", "mapd-healthy"):
            write_run(folder / problem, made_solution(problem))
        write_run(folder / "broken", made_solution("mapd-barefoot", status="iteration limit"))
    return folder


def run(*words: object) -> Result:
    """Run a command."""
    return CliRunner().invoke(cli, [*map(str, words)])


def refusal(*words: object) -> str:
    """Return the one sentence with which a command refuses."""
    result = run(*words)
    assert result.exit_code == 2, result.output
    assert result.output.count("\n") == 1
    assert "Traceback" not in result.output
    return result.output


# The stride


def test_frames_hold_one_stride(frames: GaitFrames) -> None:
    assert frames.count == len(frames.phase) == COUNT
    assert frames.duration == pytest.approx(GAIT.stride_time)
    assert frames.distance == pytest.approx(GAIT.stride_length)
    assert frames.walking_speed == pytest.approx(GAIT.walking_speed)
    assert all(xz.shape == (COUNT, 2) and np.isfinite(xz).all() for xz in frames.points.values())
    assert {xz.shape for xz in frames.force.values()} == {(COUNT, 2)}
    assert frames.activation.shape == (COUNT, len(GENERATORS))
    assert frames.notes == ()


def test_the_cycle_begins_where_and_when_the_right_heel_strikes(frames: GaitFrames) -> None:
    assert frames.phase[0] == "left_toe_right_heel"
    assert frames.phase[-1] == "left_toe"
    assert frames.points["heel_r"][0, 0] == 0.0
    first = [name for i, name in enumerate(frames.phase) if i == 0 or frames.phase[i - 1] != name]
    names = [phase.name for phase in PHASES]
    start = names.index("left_toe_right_heel")
    assert first == [*names[start:], *names[:start]]


def test_the_next_stride_follows_without_a_jump(frames: GaitFrames) -> None:
    for xz in frames.points.values():
        steps = np.linalg.norm(np.diff(xz, axis=0), axis=1)
        last = np.linalg.norm(xz[0] + [frames.distance, 0.0] - xz[-1])
        assert last <= 1.2 * steps.max()


def test_instants_are_those_of_any_other_number_of_instants(frames: GaitFrames) -> None:
    fewer = gait_frames(stylised_series("orthosis"), "worn", "mapd-orthosis", COUNT // 2)
    for name, xz in fewer.points.items():
        assert frames.points[name][::2] == pytest.approx(xz)


def test_standing_points_stay_on_the_ground_and_where_they_are(frames: GaitFrames) -> None:
    for name in (phase.name for phase in PHASES):
        rows = np.flatnonzero(np.array(frames.phase) == name)
        for point in phase_named(name).points:
            x, z = frames.points[point.name][rows].T
            assert np.abs(z).max() < SPREAD
            assert np.ptp(x) < SPREAD


def test_forces_never_mix_two_phases(frames: GaitFrames) -> None:
    series = stylised_series("orthosis")
    for side in SIDES:
        known = {name: series.vertical_force(side)[i] for i, name in enumerate(series.phase)}
        for name, force in zip(frames.phase, frames.force[side], strict=True):
            assert np.nan_to_num(force[1]) == pytest.approx(known[name])


def test_a_stride_that_does_not_close_is_told() -> None:
    series = stylised_series("orthosis")
    q = series.q.copy()
    q[-1, 4] += 0.05
    (note,) = gait_frames(replace(series, q=q), "open", "ls-barefoot", 20).notes
    assert "0.05 m or rad" in note


# The drawing


def test_arrows_stand_at_the_centre_of_pressure_as_long_as_the_force(drawn: Drawing) -> None:
    frames = drawn.frames
    for side in SIDES:
        s, bearing = SUFFIX[side], np.isfinite(frames.pressure[side])
        assert np.isfinite(drawn.arrows[side]).all(axis=(1, 2)).tolist() == bearing.tolist()
        assert bearing.any()
        assert not bearing.all()
        corners = drawn.arrows[side][bearing]
        start, tip = (corners[:, 0] + corners[:, -1]) / 2, corners[:, 3]
        length = np.linalg.norm(tip - start, axis=1)
        wanted = force_scale(frames) * np.linalg.norm(frames.force[side][bearing], axis=1)
        assert length == pytest.approx(wanted)
        assert start[:, 1] == pytest.approx(np.zeros(bearing.sum()))
        heel, toe = (frames.points[f"{point}_{s}"][bearing, 0] for point in ("heel", "toe"))
        assert (start[:, 0] > heel - SPREAD).all()
        assert (start[:, 0] < toe + SPREAD).all()


def test_one_body_weight_is_an_arrow_of_six_tenths_of_the_pelvis_height(frames: GaitFrames) -> None:
    assert force_scale(frames) * frames.weight == pytest.approx(0.6 * frames.pelvis_height)


def test_every_muscle_lies_on_its_side_of_the_segment(drawn: Drawing) -> None:
    muscles = {
        GENERATORS[shape.generator]: shape for shape in drawn.shapes if shape.generator is not None
    }
    assert sorted(muscles) == sorted(GENERATORS)
    for name, shape in muscles.items():
        middle = shape.at(drawn.points, 0).mean(axis=0)
        start, end = drawn.points[shape.start][0], drawn.points[shape.end][0]
        share = (middle - start) @ (end - start) / ((end - start) @ (end - start))
        ahead = (middle - start - share * (end - start))[0]
        front = ("hip_flexion", "knee_extension", "ankle_flexion", "lumbar_extension")
        assert (ahead > 0.0) == name.startswith(front), name


def test_the_orthosis_is_drawn_only_where_it_is_worn(drawn: Drawing) -> None:
    kinds = [shape.kind for shape in drawn.shapes]
    assert (kinds.count("shell"), kinds.count("spring")) == (4, 2)
    bare = drawing(gait_frames(stylised_series("barefoot"), "bare", "mapd-barefoot", 20))
    assert {"shell", "spring"}.isdisjoint(shape.kind for shape in bare.shapes)


def test_the_foot_is_the_triangle_of_heel_toe_and_ankle(drawn: Drawing) -> None:
    for shape in drawn.shapes:
        if shape.kind == "foot":
            s = SUFFIX[shape.side or "right"]
            wanted = [drawn.points[f"{name}_{s}"][7] for name in ("heel", "toe", "ankle")]
            assert shape.at(drawn.points, 7) == pytest.approx(np.array(wanted), abs=1e-9)


def test_the_view_holds_all_that_moves(drawn: Drawing) -> None:
    view, frames = common_view([drawn]), drawn.frames
    for i, eye in enumerate(frames.middle + frames.cycle * frames.distance):
        for shape in drawn.shapes:
            x, z = shape.at(drawn.points, i).T
            assert np.abs(x - eye).max() < view.half_width
            assert z.max() < view.top
            assert z.min() > view.bottom


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("right_flat", "right flat"),
        ("right_toe_left_heel", "right toe, left heel"),
        ("hip_extension_r", "hip extension, right"),
        ("lumbar_flexion", "lumbar flexion"),
    ],
)
def test_names_in_words(name: str, said: str) -> None:
    assert words(name) == said


# The page


class Tags(HTMLParser):
    """Collects the tags of a page and the text of its scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] == "script" and data.strip():
            self.scripts.append(data)

    @property
    def data(self) -> dict:
        """The content of the script that holds data."""
        return json.loads(self.scripts[0])


@pytest.fixture(scope="module")
def page(frames: GaitFrames) -> str:
    bare = gait_frames(stylised_series("barefoot"), "bare", "mapd-barefoot", COUNT)
    return html_page([bare, frames])


def test_the_page_stands_alone_and_is_small(page: str) -> None:
    assert re.findall(r"https?:[^\s\"']*", page) == ["http://www.w3.org/2000/svg"]
    tags = Tags(page).tags
    assert {"link", "img", "iframe", "object", "base"}.isdisjoint(tag for tag, _ in tags)
    assert {"src", "href", "srcset", "action"}.isdisjoint(key for _, attrs in tags for key in attrs)
    assert "url(" not in page
    assert "@import" not in page
    assert len(page.encode()) < 500_000


def test_the_data_of_the_page_are_those_of_the_strides(page: str, drawn: Drawing) -> None:
    data = Tags(page).data
    assert [each["name"] for each in data["runs"]] == ["bare", "worn"]
    worn = data["runs"][1]
    assert worn["duration"] == drawn.frames.duration
    assert np.array(worn["points"]["knee_l"]) == pytest.approx(drawn.points["knee_l"], abs=5.1e-5)
    assert len(worn["shapes"]) == len(drawn.shapes)
    bearing = np.isfinite(drawn.frames.pressure["left"])
    assert [arrow is not None for arrow in worn["arrows"][1]] == bearing.tolist()


def test_controls_have_names(page: str) -> None:
    named = [a for tag, a in Tags(page).tags if a.get("role") == "img" or a.get("id") == "cycle"]
    assert len(named) == 4
    assert all(attrs.get("aria-label") for attrs in named)


def test_hostile_names_stay_text(frames: GaitFrames) -> None:
    for name in (HOSTILE, "</script><img src=x onerror=alert(1)>", '" onload="alert(1)'):
        page = html_page([replace(frames, name=name, notes=(name,))])
        found = Tags(page)
        assert name not in page
        assert [tag for tag, _ in found.tags].count("script") == 2
        assert "img" not in [tag for tag, _ in found.tags]
        assert not any("onload" in attrs or "onerror" in attrs for _, attrs in found.tags)
        assert found.data["runs"][0]["name"] == name


# What is recorded


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_c3d(tmp_path_factory.mktemp("c3d") / "walk.c3d")


def test_a_recorded_cycle_is_the_one_between_right_strikes(walk: Path) -> None:
    walker = walker_of("barefoot")
    behind = recorded_frames(walker, str(walk), 65)
    (q, paths), rows = motion(), np.arange(50, 115)
    assert behind.duration == pytest.approx(65 / 120.0)
    share = np.arange(65) / 65
    eye = share * (q[115, 0] - q[50, 0])
    for name in ("hip_r", "toe_l", "neck"):
        wanted = np.array([body_points(walker, q[row])[name] for row in rows])
        moved = behind.points[name] - wanted + np.stack([eye, 0 * eye], axis=1)
        assert np.ptp(moved[:, 0]) < 1e-5, "all points are moved alike"
        assert np.abs(moved[:, 1]).max() < 1e-5
    assert behind.points["hip_r"][:, 0].mean() == pytest.approx(0.0, abs=1e-9)
    assert set(behind.markers) == set(paths)
    apart = behind.markers["RTOE"] - behind.markers["LTOE"]
    assert apart == pytest.approx((paths["RTOE"] - paths["LTOE"])[rows][:, [0, 2]], abs=1e-5)


def test_a_recording_of_the_patient_is_drawn_behind_in_step(frames: GaitFrames) -> None:
    behind = recorded_frames(walker_of("orthosis"), "3053138", COUNT)
    assert not behind.markers
    heel = behind.points["heel_r"]
    assert heel[0, 0] == pytest.approx(heel[:, 0].max(), abs=0.03), "it strikes the ground first"
    plain, both = drawing(frames), drawing(replace(frames, recorded=behind))
    names = [shape.kind for shape in both.shapes]
    assert names[: names.index("recorded") + 1] == ["recorded"]
    assert [kind for kind in names if kind != "recorded"] == [s.kind for s in plain.shapes]
    hips = both.points["recorded hip_r"][:, 0] - both.points["hip_r"][:, 0]
    assert abs(hips.mean()) < 1e-9, "both walk before the same eye"
    assert "recorded, trial 3053138" in html_page([replace(frames, recorded=behind)])


def test_animations_show_recordings_and_videos(runs: Path, walk: Path, tmp_path: Path) -> None:
    page, film = tmp_path / "page.html", tmp_path / "film.gif"
    video = tmp_path / "the child.mp4"
    video.write_bytes(b"")
    options = ("--recorded", walk, "--video", video, "--video-start", 1.5)
    assert run("animate", runs / "mapd-barefoot", "-o", page, *options).exit_code == 0
    tags = Tags(page.read_text(encoding="utf-8"))
    assert tags.data["video"] == {"start": 1.5, "stride": pytest.approx(65 / 120.0)}
    assert 'src="the%20child.mp4"' in page.read_text(encoding="utf-8")
    options = ("--recorded", walk, "--fps", 2)
    assert run("animate", runs / "mapd-barefoot", "-o", film, *options).exit_code == 0


# The commands


def test_two_runs_give_a_page(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "both.html"
    result = run("animate", runs / "mapd-barefoot", runs / "mapd-orthosis", "-o", out)
    assert (result.exit_code, result.output) == (0, f"Written to {out}\n")
    data = Tags(out.read_text(encoding="utf-8")).data
    assert [each["name"] for each in data["runs"]] == ["mapd-barefoot", "mapd-orthosis"]
    counts = {len(each["phases"]) for each in data["runs"]}
    assert counts == {round(100 * GAIT.stride_time)}


def test_a_run_of_one_step_is_shown_with_its_mirror_image(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "healthy.html"
    assert run("animate", runs / "mapd-healthy", "-o", out).exit_code == 0
    assert len(set(Tags(out.read_text(encoding="utf-8")).data["runs"][0]["phases"])) == 8


def test_the_name_of_a_folder_cannot_harm(runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "mapd-barefoot", tmp_path / HOSTILE)
    out = tmp_path / "page.html"
    assert run("animate", tmp_path / HOSTILE, "-o", out).exit_code == 0
    assert HOSTILE not in out.read_text(encoding="utf-8")


def test_gif_has_the_wanted_frames_and_delay(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "film.GIF"
    both = (runs / "mapd-barefoot", runs / "mapd-orthosis")
    result = run("animate", *both, "-o", out, "--fps", 3, "--slow", 0.5, "--strides", 3)
    assert result.exit_code == 0, result.output
    with Image.open(out) as film:
        assert film.n_frames == 3 * round(0.5 * film_rate(out, 3.0) * GAIT.stride_time)
        assert film.info["duration"] == 330
        assert film.info["loop"] == 0
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


@pytest.mark.parametrize("wanted", [3.0, 12.0, 24.0, 25.0, 30.0, 60.0])
def test_a_gif_shows_frames_for_whole_hundredths_of_a_second(wanted: float) -> None:
    hundredths = 100.0 / film_rate(Path("film.gif"), wanted)
    assert hundredths == pytest.approx(round(hundredths))
    assert hundredths == pytest.approx(100.0 / wanted, abs=0.5)
    assert film_rate(Path("film.mp4"), wanted) == wanted


def test_names_with_dollars_are_no_formulas(runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "mapd-barefoot", tmp_path / r"$\frac$")
    out = tmp_path / "film.gif"
    result = run("animate", tmp_path / r"$\frac$", "-o", out, "--fps", 1)
    assert result.exit_code == 0, result.output


def test_mp4(runs: Path, tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.importorskip("imageio_ffmpeg", reason="neither ffmpeg nor imageio-ffmpeg is there")
    out = tmp_path / "film.mp4"
    result = run("animate", runs / "mapd-orthosis", "-o", out, "--fps", 3)
    assert result.exit_code == 0, result.output
    assert out.read_bytes()[4:8] == b"ftyp"


def test_mp4_without_ffmpeg_is_refused(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    out = tmp_path / "film.mp4"
    assert "pip install imageio-ffmpeg" in refusal("animate", runs / "mapd-orthosis", "-o", out)
    assert not out.exists()


def test_an_ffmpeg_that_fails_is_told_of(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\nexec /bin/false\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    out = tmp_path / "film.mp4"
    assert "could not make the film" in refusal("animate", runs / "mapd-orthosis", "-o", out)
    assert [path.name for path in tmp_path.iterdir()] == ["ffmpeg"]


def test_refusals(runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    bare, worn, healthy = (runs / f"mapd-{name}" for name in ("barefoot", "orthosis", "healthy"))
    assert "allowed: .html, .gif, .mp4" in refusal("animate", bare, "-o", "film.avi")
    assert "one or two runs" in refusal("animate", bare, worn, healthy, "-o", "page.html")
    assert "named twice" in refusal("animate", bare, bare, "-o", "page.html")
    assert "solve it again first" in refusal("animate", runs / "broken", "-o", "page.html")
    assert "is no run folder" in refusal("animate", tmp_path, "-o", "page.html")
    assert "there is no folder" in refusal("animate", bare, "-o", "nowhere/page.html")
    assert "is a folder" in refusal("animate", bare, "-o", make(tmp_path / "folder.html"))
    assert "is not a number" in refusal("animate", bare, "-o", "film.gif", "--slow", "nan")
    for option in ("--strides", "--fps", "--slow"):
        assert f"{option}: is about films" in refusal("animate", bare, "-o", "a.html", option, 2)
    assert "no orthosis recording" in refusal("animate", worn, "-o", "a.html", "--recorded", "x")
    assert "no such file" in refusal("animate", worn, "-o", "a.html", "--video", "x.mp4")
    assert "by pages only" in refusal("animate", worn, "-o", "a.gif", "--video", "x.mp4")
    assert "no kind of video" in refusal("animate", worn, "-o", "a.html", "--video", "x.avi")
    assert "of no video" in refusal("animate", worn, "-o", "a.html", "--video-start", 1)
    many = ("--strides", 100, "--slow", 50)
    assert "at most 3000" in refusal("animate", bare, "-o", "film.gif", *many)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.html"]


def make(folder: Path) -> Path:
    """Make a folder and return it."""
    folder.mkdir()
    return folder


# The view in 3D


def test_poses_walk_on_the_spot() -> None:
    series = stylised_series("orthosis")
    q = poses(series, series.duration * np.array([0.0, 0.5, 1.0, 7.5]))
    assert q[2] == pytest.approx(q[0])
    assert q[3] == pytest.approx(q[1])
    assert np.abs(q[:, 0]).max() < 0.1 * series.distance
    assert q[0, 1:] == pytest.approx(series.q[0, 1:])


@pytest.mark.parametrize(("condition", "parts"), [("barefoot", 14), ("orthosis", 16)])
def test_bodies_reach_from_joint_to_joint(condition: str, parts: int) -> None:
    walker = stylised_series(condition).walker  # type: ignore[arg-type]
    geometry = walker_geometry(walker)
    assert geometry.ngeoms == parts
    shank = geometry.geometryObjects[geometry.getGeometryId("shank_r")]
    ankle = walker.model.jointPlacements[walker.model.getJointId("ankle_r")].translation
    end = shank.placement.act(np.array([0.0, 0.0, shank.geometry.halfLength]))
    assert end[[0, 2]] == pytest.approx(ankle[[0, 2]])
    assert end[1] < 0.0


def test_without_meshcat_the_view_says_how_to_get_it(
    runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "meshcat", None)
    assert "pip install meshcat" in refusal("view", runs / "mapd-orthosis", "--no-open")


def test_a_run_that_did_not_converge_is_not_shown(runs: Path) -> None:
    assert "solve it again first" in refusal("view", runs / "broken", "--no-open")


def test_the_view_plays_a_stride(runs: Path) -> None:
    pytest.importorskip("meshcat", reason="MeshCat is not installed")
    result = run("view", runs / "mapd-orthosis", "--no-open", "--strides", 1)
    assert result.exit_code == 0, result.output
    assert re.search(r"http://127\.0\.0\.1:\d+", result.output)


@pytest.mark.parametrize(
    ("duration", "words"), [(1.0, "in its own time"), (1.14, "14 % faster than it walks"),
                            (0.8, "25 % slower than it walks")],
)  # fmt: skip
def test_the_clock_of_a_second_walker_is_told(duration: float, words: str) -> None:
    first = gait_frames(stylised_series("barefoot"), "a", "mapd-barefoot", 4)
    second = replace(first, name="b", duration=duration * first.duration)
    assert pace([first, second]).endswith(f"at the pace of a: b is shown {words}.")
