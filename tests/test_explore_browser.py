"""The page of an explored run in a real browser, with a server behind it and without."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from conftest import sketch
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.explore.offline import offline_page
from pathwalker_cli.explore.server import serve
from pathwalker_cli.explore.session import Session
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.studies.run import run_study
from test_animation_browser import BROWSER, GUARD, browser

__all__ = ["browser"]

K_D = "orthosis.stiffness_guess.dorsiflexion.right"
TURN = """([i, value]) => {
  const dial = document.querySelectorAll("[data-dial]")[i];
  dial.value = value;
  dial.dispatchEvent(new Event("input"));
}"""

pytestmark = [
    pytest.mark.skipif(BROWSER is None, reason="neither chromium nor google-chrome is on PATH"),
    pytest.mark.xdist_group("browser"),
]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("explored") / "run"
    config = with_values(smoke_version(load_config("mapd-orthosis")), {"solver.tolerance": 1e-7})
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        run_study(config, folder)
    return load_run(folder)


@pytest.fixture
def address(run: Run, tmp_path: Path) -> Iterator[str]:
    """Yield the address of a server that must have ended with its page."""
    told: list[str] = []
    ready = threading.Event()

    def tell(url: str) -> None:
        told.append(url)
        ready.set()

    serving = threading.Thread(target=lambda: asyncio.run(serve(run.folder, tmp_path, tell, 0.5)))
    serving.start()
    assert ready.wait(GUARD / 1000)
    yield told[0]
    serving.join(GUARD / 1000)
    assert not serving.is_alive()


def opened(browser: Any, url: str, troubles: list[str]) -> Any:
    page = browser.new_page(viewport={"width": 1300, "height": 900}, reduced_motion="reduce")
    page.set_default_timeout(GUARD)
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda message: troubles.append(message.text))
    page.goto(url)
    return page


def says(page: Any, kind: str) -> None:
    page.wait_for_function("kind => document.querySelector('#kind').textContent === kind", arg=kind)


def cost(page: Any, column: int = 0) -> float:
    return float(page.locator(".numbers tbody tr").first.locator("td").nth(column).inner_text())


def test_moves_on_the_page_are_answered_and_can_be_saved(
    browser: Any, address: str, run: Run, tmp_path: Path
) -> None:
    troubles: list[str] = []
    page = opened(browser, address, troubles)
    says(page, "the run")
    assert cost(page) == pytest.approx(run.metrics["cost"], abs=1e-4)
    for value in (60.0, 85.0):  # two quick moves: the last one wins
        page.evaluate(TURN, [0, value])
    says(page, "solved")
    session = Session(run)
    wanted = session.solve({dial.key: dial.value for dial in session.dials} | {K_D: 85.0})
    page.wait_for_function("!document.querySelector('#save').disabled")
    assert cost(page) == pytest.approx(wanted.cost, abs=1e-4)
    assert cost(page, 1) == pytest.approx(run.metrics["cost"], abs=1e-4)
    assert page.locator(".shadow").first.get_attribute("d"), "the state before is a shadow"
    page.fill("#name", "stiffer")
    page.click("#save")
    says(page, "saved")
    assert load_run(tmp_path / "stiffer").metrics["cost"] == pytest.approx(wanted.cost, rel=1e-2)
    page.fill("#name", "stiffer")
    page.click("#save")
    says(page, "not possible")
    page.click("#home")
    says(page, "solved")
    assert cost(page) == pytest.approx(run.metrics["cost"], abs=1e-4)
    page.close()
    assert not troubles


def test_sides_move_together_and_fit_a_narrow_screen(browser: Any, address: str) -> None:
    troubles: list[str] = []
    page = opened(browser, address, troubles)
    page.locator("[data-tied]").first.check()
    page.evaluate(TURN, [0, 70.0])
    assert page.locator("#value-0").inner_text() == page.locator("#value-1").inner_text() == "70.0"
    page.set_viewport_size({"width": 400, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    page.close()
    assert not troubles


def test_the_page_without_a_server_says_that_nothing_is_solved(
    browser: Any, run: Run, tmp_path: Path
) -> None:
    file, troubles = tmp_path / "page.html", list[str]()
    file.write_text(offline_page(run), encoding="utf-8")
    page = opened(browser, file.as_uri(), troubles)
    says(page, "the run")
    session = Session(run)
    dial = next(dial for dial in session.dials if dial.key == K_D)
    page.evaluate(TURN, [0, dial.value - 1.0])
    says(page, "first order")
    guess = session.first_order({K_D: dial.value - 1.0})
    assert guess is not None
    assert cost(page) == pytest.approx(guess.cost, abs=1e-3)
    page.close()
    assert not troubles
