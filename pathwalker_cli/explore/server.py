"""The server of an explored run: one page and one socket, for this machine alone.

It listens on the loopback only, behind an address with a token that nobody can guess, and refuses
every other Host (names that an attacker points at this machine) and Origin (pages from elsewhere).
"""

from __future__ import annotations

import asyncio
import json
import math
import re
import secrets
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from hmac import compare_digest
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.explore.worker import serve_moves
from pathwalker_cli.io.processes import begun_process

_HOST: Final = "127.0.0.1"
_LOST: Final = "the solver was ended from outside (out of memory?); call again"
_NAME: Final = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,79}")
"""Names of folders that settings may be saved in."""
_LARGEST: Final = 100_000
"""Bytes of the longest message from a page."""
_GRACE: Final = 3.0
"""Time without any page after which the server ends [s]: a page that is loaded anew is back by
then."""


async def serve(
    folder: Path, places: Path, told: Callable[[str], None], grace: float = _GRACE
) -> None:
    """Serve a run until its last page closes.

    Args:
        folder: The folder of the run.
        places: The folder in which settings are saved.
        told: Is given the address once it answers.
        grace: Time without any page after which it ends [s].

    Raises:
        NotConvergedError: If the run cannot be solved again, or the solver was ended from outside.
    """
    process, connection = begun_process(serve_moves, folder, places)
    desk = Desk(connection, places, grace)
    try:
        await desk.ready
        server = HTTPServer(desk.application())
        sockets = bind_sockets(0, _HOST, family=socket.AF_INET)
        desk.listens_at(sockets[0].getsockname()[1])
        server.add_sockets(sockets)
        told(f"http://{desk.hosts[0]}/{desk.token}/")
        await desk.ended
        server.stop()
    finally:
        desk.close()
        process.terminate()
        process.join()


class Desk:
    """Stands between pages and the solver; see `serve`."""

    def __init__(self, connection: Connection, places: Path, grace: float) -> None:
        self._connection, self._places, self._grace = connection, places, grace
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(connection.fileno(), self._hear)
        self.ready: asyncio.Future[None] = self._loop.create_future()
        self.ended: asyncio.Future[None] = self._loop.create_future()
        self.token = secrets.token_urlsafe(24)
        self.hosts: tuple[str, ...] = ()
        self.page = ""
        self._keys: frozenset[str] = frozenset()
        self._pages: set[Socket] = set()
        self._moves = 0
        self._state: Mapping[str, Any] | None = None
        self._closing: asyncio.TimerHandle | None = None

    def application(self) -> Application:
        """Return what answers requests."""
        routes = [
            (r"/([^/]+)/", Page, {"desk": self}),
            (r"/([^/]+)/socket", Socket, {"desk": self}),
        ]
        return Application(
            routes, websocket_max_message_size=_LARGEST, log_function=lambda handler: None
        )  # fmt: skip

    def listens_at(self, port: int) -> None:
        """Take note of the port: of the names by which pages may call this machine."""
        self.hosts = (f"{_HOST}:{port}", f"localhost:{port}")

    def opened(self, page: Socket) -> None:
        """Let a page know what there is."""
        self._pages.add(page)
        if self._closing is not None:
            self._closing.cancel()
        if self._state is not None:
            page.say({"kind": "moved", **{k: self._state[k] for k in ("number", "settings")}})
            page.say(self._state)

    def closed(self, page: Socket) -> None:
        """End when no page is left."""
        self._pages.discard(page)
        if not self._pages:
            self._closing = self._loop.call_later(self._grace, self._end)

    def asked(self, text: str | bytes) -> None:
        """Hand a message of a page on to the solver.

        Raises:
            ValueError: If it is none.
        """
        message = json.loads(text)
        kind = message["kind"]
        if kind == "move":
            settings = message["settings"]
            for key, value in settings.items():
                number = isinstance(value, int | float) and math.isfinite(value)
                if key not in self._keys or not (number or value is None):
                    raise ValueError(key)
            self._moves += 1
            asked = {"kind": "move", "number": self._moves, "settings": settings}
            self._say({**asked, "kind": "moved"})
            self._connection.send(asked)
        elif kind == "save":
            self._save(message["name"])
        else:
            raise ValueError(kind)

    def _save(self, name: str) -> None:
        """Let the solver save what is shown, if a new folder of this name may be."""
        folder, refused = self._places / name, {"kind": "refused", "number": self._moves}
        if not _NAME.fullmatch(name):
            allowed = "allowed: letters, digits, point, underscore and hyphen, no point first"
            self._say({**refused, "sentence": f"'{name}' is no name of a folder; {allowed}"})
        elif folder.exists():
            self._say({**refused, "sentence": f"{folder} is there already; choose another name"})
        else:
            self._connection.send({"kind": "save", "number": self._moves, "name": name})

    def _hear(self) -> None:
        try:
            message = self._connection.recv()
        except (EOFError, OSError):
            message = {"kind": "ended", "sentence": _LOST}
        if message["kind"] == "ready":
            self.page, self._keys = message["page"], frozenset(message["keys"])
            self.ready.set_result(None)
            return
        if message["kind"] == "ended":
            self._loop.remove_reader(self._connection.fileno())
            waiting = self.ended if self.ready.done() else self.ready
            waiting.set_exception(NotConvergedError(message["sentence"]))
        elif message["kind"] in ("solved", "better"):
            self._state = message
        self._say(message)

    def _say(self, message: Mapping[str, Any]) -> None:
        for page in self._pages:
            page.say(message)

    def _end(self) -> None:
        if not self.ended.done():
            self.ended.set_result(None)

    def close(self) -> None:
        """Let go of pages and solver."""
        self._loop.remove_reader(self._connection.fileno())
        for page in tuple(self._pages):
            page.close()
        self._connection.close()


class _Guarded(RequestHandler):
    """A request that knows the token and comes by the right name."""

    def initialize(self, desk: Desk) -> None:
        self.desk = desk

    def prepare(self) -> None:
        """Refuse whoever has no business here.

        Raises:
            HTTPError: If it is so.
        """
        if self.request.host not in self.desk.hosts:
            raise HTTPError(403, reason="Foreign host")
        if not compare_digest(self.path_args[0].encode(), self.desk.token.encode()):
            raise HTTPError(404)
        origin = self.request.headers.get("Origin")
        if origin is not None and not self.from_here(origin):
            raise HTTPError(403, reason="Foreign origin")

    def from_here(self, origin: str) -> bool:
        """Return whether a page of this server asks."""
        return origin in {f"http://{host}" for host in self.desk.hosts}


class Page(_Guarded):
    """The page."""

    def set_default_headers(self) -> None:
        """Let no other page embed it, and none keep it."""
        headers = {"X-Frame-Options": "DENY", "Cache-Control": "no-store",
                   "Referrer-Policy": "no-referrer",
                   "X-Content-Type-Options": "nosniff"}  # fmt: skip
        for name, value in headers.items():
            self.set_header(name, value)

    def get(self, token: str) -> None:
        """Send it."""
        self.finish(self.desk.page)


class Socket(_Guarded, WebSocketHandler):
    """What the page talks through."""

    def check_origin(self, origin: str) -> bool:
        """Return whether the page is this server's own."""
        return self.from_here(origin)

    def open(self, token: str) -> None:
        """Begin."""
        self.desk.opened(self)

    def on_message(self, message: str | bytes) -> None:
        """Hand on; who talks nonsense is hung up on."""
        try:
            self.desk.asked(message)
        except (ValueError, KeyError, TypeError, AttributeError):
            self.close(1003, "no message of this page")

    def on_close(self) -> None:
        """End."""
        self.desk.closed(self)

    def say(self, message: Mapping[str, Any]) -> None:
        """Send a message to the page."""
        with suppress(WebSocketClosedError):
            self.write_message(json.dumps(message))
