"""A config that is a file of another kind is told so, whichever command it is given to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pathwalker_cli.errors import ConfigError

__all__ = ["meant_as"]


@contextmanager
def meant_as(kind: str, path: object) -> Iterator[None]:
    """Say of a config that is refused, if so, that it is a file of another kind, and whose.

    Args:
        kind: Its kind in `checking.kinds.KINDS`.
        path: The config, a file or the name of a shipped one.
    """
    try:
        yield
    except ConfigError as error:
        # loaded only where something is wrong: it knows every kind of file
        from pathwalker_cli.checking.kinds import another_kind

        raise another_kind(str(path), kind) or error from None
