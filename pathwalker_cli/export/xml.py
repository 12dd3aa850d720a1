"""The XML files of OpenSim: documents of nodes, and vectors in its axes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final
from xml.etree import ElementTree

from pathwalker_cli.model.anthropometry import Vector

Node = ElementTree.Element

_VERSION: Final = "40000"
"""Of the format: that of OpenSim 4.0, which all later ones read."""


def document(content: Node) -> str:
    """Return the text of a file that holds this."""
    whole = ElementTree.Element("OpenSimDocument", Version=_VERSION)
    whole.append(content)
    ElementTree.indent(whole, "\t")
    text = ElementTree.tostring(whole, "unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def node(tag: str, *inside: Node, name: str = "", **values: str) -> Node:
    """Return a node with a name, or none, that holds values by tag and then other nodes."""
    made = ElementTree.Element(tag, {"name": name} if name else {})
    for key, value in values.items():
        ElementTree.SubElement(made, key).text = value
    made.extend(inside)
    return made


def collection(tag: str, name: str, objects: Iterable[Node]) -> Node:
    """Return a set of objects."""
    return node(tag, node("objects", *objects), name=name)


def numbers(*values: float) -> str:
    """Return numbers with twelve digits, without negative zeros."""
    return " ".join(f"{value + 0.0:.12g}" for value in values)


def place(vector: Sequence[float]) -> Vector:
    """Return a vector (forward, left, up) in OpenSim's axes: forward, up, right."""
    forward, left, up = vector
    return forward, up, -left
