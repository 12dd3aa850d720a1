"""Another block in a YAML file that people wrote: the rest, comments too, stays as it is."""

from __future__ import annotations

import re
from collections.abc import Sequence

__all__ = ["with_block"]


def with_block(text: str, key: str, lines: Sequence[str]) -> str:
    """Return the text of a YAML file with a block in place of the one under a key.

    Comments above the key stay; those within the block go.  A block that is not there yet is
    added at the end.

    Args:
        text: The text of the file.
        key: The outermost key.
        lines: The block, the key's line among them.
    """
    found = text.splitlines()
    begin = next((i for i, line in enumerate(found) if re.match(rf"{key}\s*:", line)), None)
    if begin is None:
        return "\n".join([*found, "", *lines]) + "\n"
    end = begin + 1
    while end < len(found) and (not found[end].strip() or found[end][0] in " \t"):
        end += 1
    while not found[end - 1].strip():
        end -= 1
    return "\n".join([*found[:begin], *lines, *found[end:]]) + "\n"
