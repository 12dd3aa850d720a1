"""YAML files that explain themselves: the value and the comment of each of their keys."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml


@dataclass(frozen=True)
class Entry:
    """One key of a file.

    Args:
        place: Dotted key, e.g. "bounds.friction".
        parents: The keys that lead to it, and itself.
        value: Its value as it is written; "" for a block of further keys.
        comment: What stands beside it.
    """

    place: str
    parents: tuple[str, ...]
    value: str
    comment: str


def reasons(path: Path) -> dict[str, str]:
    """Return the comment of every dotted key of a YAML file.

    A comment goes on in the lines below it that hold only a comment, further in than the key.
    Comments above a key within a block are its own if nothing stands beside it.
    """
    comments: dict[str, str] = {}
    parents: list[tuple[int, str]] = []
    key, commented, above = "", False, ""
    for line in path.read_text(encoding="utf-8").splitlines():
        entry = re.match(r"(?P<indent> *)(?P<key>[\w.]+):(?P<rest>.*)$", line)
        mark = re.search(r"(?:^|\s)#\s?(?P<text>.*)$", line)
        if entry:
            indent = len(entry["indent"])
            parents = [parent for parent in parents if parent[0] < indent]
            key = ".".join([*(name for _, name in parents), entry["key"]])
            parents.append((indent, entry["key"]))
            commented = mark is not None
            comments[key] = mark["text"].strip() if mark else above.strip()
            above = ""
        elif mark and commented and line.index("#") > parents[-1][0]:
            text = mark["text"].strip()
            comments[key] += f"; {text}" if re.match(r"\w+: ", text) else f" {text}"
        else:
            commented = False
            inside = mark is not None and line.index("#") > 0
            above = f"{above} {mark['text'].strip()}" if mark and inside else ""
    return comments


def entries(path: Path) -> tuple[Entry, ...]:
    """Return every key of a YAML file in order, values as they are written there."""
    text = path.read_text(encoding="utf-8")
    node = yaml.compose(text, yaml.SafeLoader)
    assert isinstance(node, yaml.MappingNode), path  # noqa: S101 - configs are mappings
    return tuple(_entries(node, text, reasons(path), ()))


def _entries(
    node: yaml.MappingNode, text: str, why: dict[str, str], parents: tuple[str, ...]
) -> Iterator[Entry]:
    for key, value in node.value:
        names = (*parents, str(key.value))
        place = ".".join(names)
        block = isinstance(value, yaml.MappingNode) and not value.flow_style
        yield Entry(place, names, "" if block else _written(value, text), why.get(place, ""))
        if block:
            yield from _entries(value, text, why, names)


def _written(node: yaml.Node, text: str) -> str:
    """Return a value as it is written; a list of lines as one line."""
    if isinstance(node, yaml.SequenceNode) and not node.flow_style:
        return f"[{', '.join(_written(item, text) for item in node.value)}]"
    return " ".join(text[node.start_mark.index : node.end_mark.index].split())
