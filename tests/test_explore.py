"""Playing with a run: dials, moves, the process that solves, and a server for this machine."""

from __future__ import annotations

import asyncio
import json
import re
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from conftest import MadeSolution, sketch
from helpers import GUARD, called_apart
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.errors import InputError, NotConvergedError
from pathwalker_cli.explore.dials import case_at, settings_of
from pathwalker_cli.explore.offline import offline_page
from pathwalker_cli.explore.page import picture
from pathwalker_cli.explore.server import serve
from pathwalker_cli.explore.session import STOPPED, Session
from pathwalker_cli.explore.worker import Worker
from pathwalker_cli.gait.solve import solve_study
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.studies.base import Work
from pathwalker_cli.studies.landscape import STUDY, LandscapeStudy
from pathwalker_cli.studies.run import run_study
from report_runs import write_made_run

K_D = "orthosis.stiffness_guess.dorsiflexion.right"
NEUTRAL = "orthosis.neutral_angle.right"
TIGHT = "examination.popliteal_angle.left"
SAME = (
    "orthosis.mass.foot.left",
    "strengths.hip_extension.right",
    "examination.popliteal_angle.right",
)
SPEED = "bounds.least_walking_speed"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a run on a coarse mesh, solved tightly, of a child with tissue."""
    config = smoke_version(load_config("mapd-orthosis"))
    changes = {"solver.tolerance": 1e-8, "model.tissue": True, "cost.goals": {"time": 0.01}}
    folder = tmp_path_factory.mktemp("explored") / "run"
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        assert run_study(with_values(config, changes), folder).solution.converged
    return load_run(folder)


@pytest.fixture(scope="module")
def opened(run: Run) -> Session:
    return Session(run)


@pytest.fixture
def session(opened: Session) -> Session:
    """Return a session at the run itself."""
    opened.go_home()
    return opened


def turned(session: Session, key: str, share: float = 0.05) -> dict[str, float | None]:
    """Return settings of which one is turned by a share of its range, away from the nearer end."""
    dial = next(dial for dial in session.dials if dial.key == key)
    sign = 1.0 if dial.value < (dial.low + dial.high) / 2 else -1.0
    value = dial.value + sign * share * (dial.high - dial.low)
    return {**settings_of(session.dials), key: value}


def test_dials_are_what_the_run_has(session: Session) -> None:
    groups = {dial.group for dial in session.dials}
    assert {"Orthosis", "Wish", "Strength", "Tightness"} <= groups
    keys = [dial.key for dial in session.dials]
    assert len(keys) == len(set(keys))
    assert {K_D, NEUTRAL, TIGHT, SPEED, "cost.goals.time", "orthosis.mass.foot.left",
            "strengths.hip_flexion.left", "strengths.lumbar_flexion"} <= set(keys)  # fmt: skip
    assert all(dial.low <= dial.value <= dial.high for dial in session.dials)


@pytest.mark.parametrize("key", [NEUTRAL, TIGHT, "orthosis.mass.foot.left",
                                 "strengths.hip_flexion.left", "orthosis.dorsiflexion_stop.left",
                                 "examination.dorsiflexion_knee_flexed.right"])  # fmt: skip
def test_a_dial_sets_its_own_number_and_no_other(session: Session, key: str) -> None:
    settings = turned(session, key)
    before = case_at(session.run.case, session.dials, {}).walker().values
    after = case_at(session.run.case, session.dials, settings).walker().values
    changed = {address for address in before if abs(after[address] - before[address]) > 1e-12}
    assert changed
    assert all(address.startswith(key) for address in changed)
    assert all(after[address] == pytest.approx(settings[key]) for address in changed)


def test_the_answer_is_that_of_the_command_with_the_same_config(
    session: Session, tmp_path: Path, sketched: None
) -> None:
    for key in SAME:
        session.go_home()
        settings = turned(session, key)
        end = session.solve(settings, session.first_order(settings))
        assert end.converged
        # as `pathwalker solve PROBLEM CONFIG --warm-start RUN` does
        solution = solve_study(end.case, session.run.motion)
        assert solution.converged
        assert end.cost == pytest.approx(solution.cost, rel=1e-6)
        found = end.motion.durations
        assert np.allclose(found, solution.last_motion.durations, rtol=1e-3)


def test_first_order_changes_are_those_of_small_moves(session: Session) -> None:
    for key in (K_D, NEUTRAL, TIGHT):
        session.go_home()
        home = session.optimum.cost
        far, near = (turned(session, key, share) for share in (2e-3, 2e-4))
        errors = []
        for settings in (far, near):
            session.go_home()
            guess = session.first_order(settings)
            assert guess is not None
            assert session.optimum.cost == home, "nothing is solved"
            end = session.solve(settings)
            errors.append(abs(guess.cost - end.cost))
        assert errors[1] < 0.2 * errors[0] or errors[1] < 1e-7 * home, key


def test_the_springs_may_be_left_to_the_problem(session: Session) -> None:
    settings = {**turned(session, TIGHT), K_D: None}
    assert session.first_order(settings) is None
    held = session.solve(turned(session, TIGHT)).cost
    assert session.solve(settings).cost <= held * (1.0 + 1e-7)


def test_what_cannot_be_leaves_everything_where_it_was(session: Session) -> None:
    before = session.optimum
    with pytest.raises(InputError, match="free_play"):
        session.solve({**settings_of(session.dials), "orthosis.free_play.right": -1.0})
    assert session.optimum is before
    end = session.solve({**settings_of(session.dials), SPEED: 8.0e-1, "cost.goals.time": 1e6})
    if not end.converged:
        assert session.optimum is before


class Line:
    """A connection whose messages stand ready, and that ends after the last one."""

    def __init__(self, *messages: dict[str, Any]) -> None:
        self.waiting = deque(messages)
        self.answers: list[dict[str, Any]] = []

    def poll(self) -> bool:
        return bool(self.waiting)

    def recv(self) -> dict[str, Any]:
        if not self.waiting:
            raise EOFError
        return self.waiting.popleft()

    def send(self, message: dict[str, Any]) -> None:
        self.answers.append(message)

    @property
    def kinds(self) -> list[tuple[str, int]]:
        return [(m["kind"], m.get("number", 0)) for m in self.answers]


def answers(run: Run, places: Path, *messages: dict[str, Any]) -> Line:
    line = Line(*messages)
    with pytest.raises(EOFError):
        Worker(line, run.folder, places).run()  # type: ignore[arg-type]
    return line


def move(number: int, settings: dict[str, float | None]) -> dict[str, Any]:
    return {"kind": "move", "number": number, "settings": settings}


def test_of_two_quick_moves_the_last_one_wins(run: Run, session: Session, tmp_path: Path) -> None:
    quick = [move(1, turned(session, TIGHT)), move(2, turned(session, K_D))]
    line = answers(run, tmp_path, *quick)
    assert line.kinds[:1] == [("ready", 0)]
    assert ("first order", 2) in line.kinds
    assert ("solved", 2) in line.kinds
    assert not any(number == 1 for _, number in line.kinds)


def test_a_solve_is_interrupted_where_somebody_asks_for_it(run: Run) -> None:
    asked: list[int] = []

    def observer(report: Any) -> bool:
        asked.append(report.iteration)
        return True

    with pytest.raises(NotConvergedError, match=STOPPED):
        Session(run, observer)
    assert asked == [0]


def test_what_is_refused_is_said_and_what_is_shown_is_saved(
    run: Run, session: Session, tmp_path: Path, sketched: None
) -> None:
    settings = turned(session, K_D)
    line = answers(
        run,
        tmp_path,
        move(1, {**settings, "orthosis.free_play.right": -1.0}),
        {"kind": "save", "number": 1, "name": "as-it-was"},
    )
    refusal = next(m for m in line.answers if m["kind"] == "refused")
    assert "free_play" in refusal["sentence"]
    saved = next(m for m in line.answers if m["kind"] == "saved")
    assert saved["cost"] == pytest.approx(run.metrics["cost"], rel=1e-6)
    again = load_run(tmp_path / "as-it-was")
    assert again.metrics["cost"] == pytest.approx(run.metrics["cost"], rel=1e-6)
    assert again.metrics["warm_start"] == str(run.folder)
    line = answers(
        run, tmp_path, move(1, settings), {"kind": "save", "number": 1, "name": "turned"}
    )
    saved = next(m for m in line.answers if m["kind"] == "saved")
    assert saved["shown"] != pytest.approx(run.metrics["cost"], rel=1e-6)
    assert saved["cost"] == pytest.approx(saved["shown"], rel=1e-9)


def test_pictures_are_plain_and_finite(session: Session) -> None:
    text = json.dumps(picture(session.optimum, session.dials), allow_nan=False)
    assert len(text) < 100_000


def test_the_server_lets_nobody_else_in_and_ends_with_its_last_page(
    run: Run, session: Session, tmp_path: Path
) -> None:
    visit = _visit(run, turned(session, K_D), tmp_path)
    asyncio.run(asyncio.wait_for(visit, GUARD))


async def _visit(run: Run, settings: dict[str, float | None], places: Path) -> None:
    told: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    served = asyncio.create_task(serve(run.folder, places, told.set_result, grace=0.1))
    await asyncio.wait([told, served], return_when=asyncio.FIRST_COMPLETED)
    url = await told
    host = url.split("/")[2]
    client = AsyncHTTPClient()

    async def code(address: str, **headers: str) -> int:
        try:
            return (await client.fetch(HTTPRequest(address, headers=headers))).code
        except HTTPClientError as error:
            return error.code

    assert host.startswith("127.0.0.1:")
    assert await code(url) == 200
    assert await code(url, Host="evil.example:80") == 403
    assert await code(url, Origin="http://evil.example") == 403
    assert await code(f"http://{host}/") == 404
    assert await code(f"http://{host}/guess/") == 404
    for origin in ("http://evil.example", f"https://{host}", "null"):
        request = HTTPRequest(f"ws://{host}{url.split(host)[1]}socket", headers={"Origin": origin})
        with pytest.raises(HTTPClientError, match="403"):
            await websocket_connect(request)
    page = (await client.fetch(url)).body.decode()
    assert "https://" not in page.replace("http://www.w3.org", "")
    own = HTTPRequest(
        f"ws://{host}{url.split(host)[1]}socket", headers={"Origin": f"http://{host}"}
    )
    talk = await websocket_connect(own)
    for text in ("[", "{}", '{"kind": "move", "settings": {"cost.effort_weight": 1}}',
                 json.dumps({"kind": "move", "settings": {K_D: "x"}})):  # fmt: skip
        nonsense = await websocket_connect(own)
        await nonsense.write_message(text)
        while await nonsense.read_message() is not None:
            pass
        assert nonsense.close_code == 1003
    await talk.write_message(json.dumps({"kind": "move", "settings": settings}))
    kinds = []
    while "solved" not in kinds:
        message = json.loads(await talk.read_message() or "")
        kinds.append(message["kind"])
    assert kinds == ["moved", "first order", "solved"]
    assert message["picture"]["found"][K_D] == pytest.approx(settings[K_D])
    (places / "there").mkdir()
    for name in ("../elsewhere", ".hidden", "", "there"):
        await talk.write_message(json.dumps({"kind": "save", "name": name}))
        while (answer := json.loads(await talk.read_message() or ""))["kind"] != "refused":
            pass
        assert "name" in answer["sentence"]
    talk.close()
    await asyncio.wait_for(served, 60)
    assert [path.name for path in places.iterdir()] == ["there"], "nothing else is written"


def test_a_page_without_a_server_holds_solved_points_and_first_order_changes(
    run: Run, session: Session
) -> None:
    study = LandscapeStudy(base="", dorsiflexion=[80.0, 90.0], plantarflexion=[6.0, 9.0],
                           leaps=False, sweeps=0)  # fmt: skip
    folder = run.folder.parent / "landscape"
    landscape = STUDY.run(study, run, Work(folder))
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        STUDY.write(landscape, folder)
    data = _data_of(offline_page(run))
    states = data["offline"]["landscape"]["states"]
    for point in landscape.points:
        if point.name != "optimum" and point.branch == 1:
            i, j = (int(text) - 1 for text in re.findall(r"\d+", point.name))
            assert states[i][j]["values"]["cost"] == pytest.approx(point.cost, rel=1e-6)
    steps = {step["key"]: step for step in data["offline"]["steps"]}
    assert set(steps) == {dial.key for dial in session.dials}
    step = steps[TIGHT]
    guess = session.first_order({TIGHT: _value(session, TIGHT) + step["step"]})
    assert guess is not None
    assert step["state"]["values"]["cost"] == pytest.approx(guess.cost, rel=1e-5)


def _value(session: Session, key: str) -> float:
    return next(dial.value for dial in session.dials if dial.key == key)


def _data_of(page: str) -> dict[str, Any]:
    match = re.search(r'id="gait-data">(.*?)</script>', page, re.DOTALL)
    assert match is not None
    data: dict[str, Any] = json.loads(match[1])
    return data


def test_a_run_without_device_or_tissue_has_dials_too(run: Run) -> None:
    config = with_values(smoke_version(load_config("mapd-barefoot")), {"verdict": False})
    case = Case.of(config)
    solution = solve_study(case)
    bare = Session(replace(run, case=case, motion=solution.last_motion, multipliers=None))
    assert {dial.group for dial in bare.dials} == {"Wish", "Strength"}
    key = "strengths.hip_flexion.left"
    assert bare.solve(turned(bare, key)).converged


def test_runs_without_neighbours_are_refused(made_solution: MadeSolution, tmp_path: Path) -> None:
    write_made_run(tmp_path / "half", made_solution, "mapd-healthy")
    write_made_run(tmp_path / "failed", made_solution, "mapd-barefoot", status="iteration limit")
    for name, sentence in (("half", "half a cycle"), ("failed", "did not converge"),
                           ("none", "no such folder")):  # fmt: skip
        done = called_apart(tmp_path, "explore", name)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert sentence in done.stderr


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("-o", "page.pdf"), "is no name of a page"),
        (("--saves", "nowhere"), "is no folder"),
    ],
)
def test_what_the_command_cannot_do_is_said(
    run: Run, words: tuple[str, ...], sentence: str
) -> None:
    done = called_apart(run.folder.parent, "explore", "run", *words)
    assert done.returncode == 2
    assert sentence in done.stderr
