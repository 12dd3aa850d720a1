"""The process that solves: the last position wins, the solve before it is interrupted.

It is told moves and saves, and answers with what `explore.js` shows.  A move is answered twice:
to first order at once, and solved; later a third time, if it costs less when begun from the run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.errors import InputError, NotConvergedError, PathwalkerError
from pathwalker_cli.explore.page import explore_page, picture
from pathwalker_cli.explore.session import STOPPED, Session
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.io.processes import prepare_worker
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.results.run_folder import load_run

_BETTER: Final = 1e-4
"""Share of the cost by which a solution from the run must be the better one to be another."""

Message = Mapping[str, Any]


def serve_moves(connection: Connection, folder: Path, places: Path) -> None:
    """Answer moves of a run, and save settings below `places`, until nobody asks any more."""
    prepare_worker()
    try:
        Worker(connection, folder, places).run()
    except (EOFError, BrokenPipeError, ConnectionResetError):  # nobody asks any more
        return
    except PathwalkerError as error:
        connection.send({"kind": "ended", "sentence": str(error)})


class Worker:
    """A session that is talked to; see `serve_moves`."""

    def __init__(self, connection: Connection, folder: Path, places: Path) -> None:
        self._connection, self._places = connection, places
        self._following: Message | None = None
        self._last: Message = {}
        """The last move."""
        self._session = Session(load_run(folder), self._interrupts)
        page = explore_page(self._session, folder.resolve().name)
        keys = [dial.key for dial in self._session.dials]
        connection.send({"kind": "ready", "page": page, "keys": keys})

    def _interrupts(self, report: ProgressReport) -> bool:
        """Return whether a solve is to be ended: somebody asks for something else."""
        return bool(self._last) and self._connection.poll()

    def run(self) -> None:
        """Answer until the connection ends."""
        while True:
            self._get_ready()
            message = self._next()
            if message["kind"] == "save":
                self._try(message, self._save)
            else:
                self._try(message, self._move)

    def _next(self) -> Message:
        """Return the next message; of moves in a row only the last one counts."""
        message, self._following = self._following or self._connection.recv(), None
        while message["kind"] == "move" and self._following is None and self._connection.poll():
            following = self._connection.recv()
            if following["kind"] == "move":
                message = following
            else:
                self._following = following
        return message

    def _try(self, message: Message, act: Callable[[Message], None]) -> None:
        """Act on a message, and say what was wrong with it."""
        try:
            act(message)
        except (InputError, NotConvergedError) as error:
            self._connection.send(
                {"kind": "refused", "number": message["number"], "sentence": str(error)}
            )

    def _move(self, message: Message) -> None:
        """Answer a move to first order, then solved."""
        settings, began, self._last = message["settings"], time.perf_counter(), message
        guess = self._session.first_order(settings)
        if guess is not None:
            self._send("first order", message, guess)
        end = self._session.solve(settings, guess)
        if end.converged:
            self._send("solved", message, end, seconds=time.perf_counter() - began)
        elif end.result.status != STOPPED:
            raise NotConvergedError(
                f"no walk was found there ({end.result.status}); what is shown is the one before: "
                "move there in smaller steps"
            )

    def _get_ready(self) -> None:
        """Use the time in which nobody asks: for the next first order, and for a second look."""
        if self._following is not None or self._connection.poll():
            return
        _ = self._session.optimum.kkt.factors
        if self._connection.poll() or not self._session.away:
            return
        before, end = self._session.optimum, self._session.solve_from_run()
        if end.converged and end.cost < before.cost - _BETTER * abs(before.cost):
            self._send("better", self._last, end)
            _ = end.kkt.factors

    def _save(self, message: Message) -> None:
        folder = self._places / message["name"]
        shown, (solution, _, _) = self._session.optimum.cost, self._session.save(folder)
        if not solution.converged:
            raise NotConvergedError(f"{folder} did not converge: {solution.status}")
        self._connection.send(
            {"kind": "saved", "number": message["number"], "folder": str(folder),
             "shown": shown, "cost": solution.cost}
        )  # fmt: skip

    def _send(self, kind: str, move: Message, optimum: Optimum, **more: Any) -> None:
        shown = picture(optimum, self._session.dials)
        self._connection.send({**move, "kind": kind, "picture": shown, **more})
