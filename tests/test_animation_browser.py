"""The page of an animation in a real browser: it moves, obeys its controls and fits the screen."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from helpers import GAIT, stylised_series
from pathwalker_cli.animation.frames import gait_frames
from pathwalker_cli.animation.html import Video, html_page

BROWSER = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
HOSTILE = "</script><img src=x onerror=alert(1)>"
CORNERS = """() => [...document.querySelectorAll(".shape")].map((shape) =>
  shape.getAttribute("d").match(/-?[0-9.]+/g).map(Number)).flat()"""
"""All numbers of all shapes, forward and up in turn [m]."""
GUARD = 120_000
"""Time after which what is waited for will never happen [ms]."""

pytestmark = [
    pytest.mark.skipif(BROWSER is None, reason="neither chromium nor google-chrome is on PATH"),
    pytest.mark.xdist_group("browser"),
]


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    runs = [
        gait_frames(stylised_series("barefoot"), HOSTILE, "mapd-barefoot", 110),
        gait_frames(stylised_series("orthosis"), "worn", "mapd-orthosis", 110),
    ]
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(html_page([replace(runs[0], notes=(HOSTILE,)), runs[1]]), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with api.sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=BROWSER)
        yield running
        running.close()


class Opened:
    """The page in the browser, with what must not happen there."""

    def __init__(self, browser: Any, file: Path, width: int = 1400, motion: str = "reduce") -> None:
        self.page = browser.new_page(
            viewport={"width": width, "height": 900}, reduced_motion=motion
        )
        self.page.set_default_timeout(GUARD)
        self.troubles: list[str] = []
        self.page.on("pageerror", lambda error: self.troubles.append(str(error)))
        self.page.on("console", lambda message: self.troubles.append(message.text))
        self.page.on("dialog", lambda dialog: (self.troubles.append("dialog"), dialog.dismiss()))
        self.page.on(
            "request",
            lambda request: request.url == file.as_uri() or self.troubles.append(request.url),
        )
        self.page.goto(file.as_uri())

    def corners(self) -> np.ndarray:
        """Return the corners of all shapes of both walkers, shape (n, 2)."""
        return np.array(self.page.evaluate(CORNERS)).reshape(-1, 2)

    def text(self, name: str, panel: int = 0) -> str:
        """Return what a panel says: "phase", "time" or "percent"."""
        return str(self.page.locator(f".now .{name}").nth(panel).inner_text())

    def percent(self) -> float:
        """Return the position in the cycle [%] that is shown."""
        return float(self.text("percent").split()[0])

    def marks(self) -> str:
        """Return the marks on the ground of the first panel."""
        return str(self.page.locator(".marks").first.get_attribute("d"))

    def labels(self) -> list[str]:
        """Return the distances on the ground of the first panel."""
        texts = self.page.locator(".labels").first.locator("text").all_text_contents()
        return [text for text in texts if text]

    def press(self, *keys: str) -> None:
        """Press keys, wherever the focus is."""
        for key in keys:
            self.page.keyboard.press(key)

    def stop_clock(self) -> None:
        """Let time pass in the page only when a test says so, however slow the machine is."""
        self.page.clock.install(time=0)
        self.page.clock.pause_at(1000)

    def wait_beyond(self, percent: float) -> None:
        """Wait until the walker is beyond a position in the cycle."""
        self.page.wait_for_function(
            "p => parseFloat(document.querySelector('.now .percent').textContent) > p", arg=percent
        )


@pytest.fixture
def opened(browser: Any, page_file: Path) -> Iterator[Opened]:
    """Return the wide page, paused."""
    page = Opened(browser, page_file)
    yield page
    page.page.close()
    assert page.troubles == []


def test_the_slider_moves_the_walker(opened: Opened) -> None:
    before, marks = opened.corners(), opened.marks()
    opened.page.locator("#cycle").fill("40")
    after = opened.corners()
    assert np.abs(after - before).max() > 0.1
    assert opened.marks() != marks
    assert opened.percent() == 40
    assert opened.text("time") == f"{0.4 * GAIT.stride_time:.2f} s"
    assert opened.text("phase") == opened.text("phase", 1) == "right toe"
    spoken = opened.page.locator("#cycle").get_attribute("aria-valuetext")
    assert spoken == "40 % of the right gait cycle, right toe"


def test_the_end_of_the_cycle_is_its_beginning_one_stride_on(opened: Opened) -> None:
    first = opened.corners()
    assert opened.labels() == ["-0.5 m", "0.0 m", "0.5 m"]
    opened.press("End")
    assert opened.percent() == 100
    assert float(opened.page.locator("#cycle").input_value()) == 100
    assert opened.corners() == pytest.approx(first, abs=5e-4)
    assert opened.labels() == ["0.0 m", "0.5 m", "1.0 m"]


def test_less_motion_is_wanted_so_it_starts_paused(opened: Opened) -> None:
    opened.stop_clock()
    assert opened.page.locator("#play").inner_text() == "Play"
    opened.page.clock.run_for(200)
    assert opened.percent() == 0


def test_the_button_plays_and_pauses(opened: Opened) -> None:
    opened.stop_clock()
    before = opened.corners()
    opened.page.locator("#play").click()
    assert opened.page.locator("#play").inner_text() == "Pause"
    opened.page.clock.run_for(200)
    assert opened.percent() > 10
    opened.page.locator("#play").click()
    assert opened.page.locator("#play").inner_text() == "Play"
    paused = opened.corners()
    assert np.abs(paused - before).max() > 0.03
    opened.page.clock.run_for(200)
    assert (opened.corners() == paused).all()


def test_it_plays_by_itself_over_several_strides(browser: Any, page_file: Path) -> None:
    opened = Opened(browser, page_file, motion="no-preference")
    opened.wait_beyond(80)
    opened.page.wait_for_function(
        "() => parseFloat(document.querySelector('.now .percent').textContent) < 50"
    )
    opened.press(" ")
    assert float(opened.labels()[-1].split()[0]) > GAIT.stride_length
    opened.page.close()
    assert opened.troubles == []


def test_keys(opened: Opened) -> None:
    opened.press("ArrowRight", "ArrowRight", "ArrowRight", "ArrowLeft")
    assert opened.percent() == 2
    opened.press("Home", "ArrowLeft")
    assert opened.percent() == 99
    opened.press("Home")
    assert opened.percent() == 0
    speed = opened.page.locator("#speed")
    for key, value in (("-", "0.5"), ("-", "0.25"), ("-", "0.25"), ("+", "0.5"), ("+", "1")):
        opened.press(key)
        assert speed.input_value() == value
    for focus in ("#cycle", "#play"):
        opened.page.locator(focus).focus()
        opened.press(" ")
        assert opened.page.locator("#play").inner_text() == "Pause"
        opened.press(" ")
        assert opened.page.locator("#play").inner_text() == "Play"


def test_a_quarter_of_the_speed_is_a_quarter_of_the_way(opened: Opened) -> None:
    opened.stop_clock()
    shares = []
    for speed in ("1", "0.25"):
        opened.press("Home")
        opened.page.locator("#speed").select_option(speed)
        opened.page.locator("#play").focus()
        opened.press(" ")
        opened.page.clock.run_for(400)
        opened.press(" ")
        shares.append(float(opened.page.locator("#cycle").input_value()))
    assert shares[0] == pytest.approx(100 * 0.4 / GAIT.stride_time, abs=4.0)
    assert shares[1] == pytest.approx(shares[0] / 4, abs=0.5)  # the step of the slider


def test_muscles_take_the_colour_of_their_activation(opened: Opened) -> None:
    fills = opened.page.evaluate(
        "() => [...document.querySelectorAll('.shape')].map((s) => s.getAttribute('fill'))"
    )
    coloured = {fill for fill in fills if fill.startswith("rgb")}
    assert coloured == {"rgb(254 227 145)"}  # a quarter of the way, which all of them are at


def test_arrows_are_there_under_load_only(opened: Opened) -> None:
    opened.page.locator("#cycle").fill("30")
    right, left = (opened.page.locator(".arrow").nth(k).get_attribute("d") for k in (0, 1))
    assert right.startswith("M")
    assert left == ""


def test_names_are_text(opened: Opened) -> None:
    assert opened.page.locator("h2").first.inner_text() == HOSTILE
    assert opened.page.locator("img").count() == 0


@pytest.mark.parametrize(("width", "beside"), [(1400, True), (400, False)])
def test_it_fits_the_screen(browser: Any, page_file: Path, width: int, beside: bool) -> None:
    opened = Opened(browser, page_file, width)
    assert opened.page.evaluate("() => document.documentElement.scrollWidth") == width
    first, second = (opened.page.locator(".panel").nth(k).bounding_box() for k in (0, 1))
    assert (first["y"] == second["y"]) == beside
    for control in ("#play", "#cycle", "#speed"):
        box = opened.page.locator(control).bounding_box()
        assert 0 <= box["x"] <= box["x"] + box["width"] <= width
        assert 0 <= box["y"] <= box["y"] + box["height"] <= 900
    opened.page.close()
    assert opened.troubles == []


RECORD = """async () => {
  const canvas = document.createElement("canvas");
  const drawing = setInterval(() => canvas.getContext("2d").fillRect(0, 0, 9, 9), 20);
  const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: "video/webm" });
  const parts = [];
  recorder.ondataavailable = (event) => parts.push(event.data);
  recorder.start();
  await new Promise((after) => setTimeout(after, 2500));
  const done = new Promise((after) => { recorder.onstop = after; });
  recorder.stop();
  await done;
  clearInterval(drawing);
  return [...new Uint8Array(await new Blob(parts).arrayBuffer())];
}"""
"""Returns the bytes of a video of two seconds and more."""


@pytest.mark.parametrize("there", [True, False])
def test_a_video_is_shown_at_the_instant_of_the_walker(
    browser: Any, tmp_path: Path, there: bool
) -> None:
    if there:
        recorder = browser.new_page()
        (tmp_path / "child.webm").write_bytes(bytes(recorder.evaluate(RECORD)))
        recorder.close()
    frames = gait_frames(stylised_series("barefoot"), "run", "mapd-barefoot", 110)
    file = tmp_path / "page.html"
    file.write_text(html_page([frames], Video("child.webm", 0.5)), encoding="utf-8")
    page = browser.new_page(reduced_motion="reduce")
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(file.as_uri())
    page.locator("#cycle").fill("50")
    if there:
        wanted = 0.5 + 0.5 * GAIT.stride_time
        page.wait_for_function(
            "wanted => Math.abs(video.currentTime - wanted) < 0.02", arg=wanted, timeout=GUARD
        )
    else:
        page.wait_for_function("() => !document.getElementById('no-video').hidden", timeout=GUARD)
    assert page.locator(".now .percent").inner_text().startswith("50 %")
    page.close()
    assert not errors
