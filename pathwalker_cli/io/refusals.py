"""One clear sentence out of what pydantic says about a refused mapping."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from pathwalker_cli.errors import InputError

__all__ = ["KeyPath", "Lines", "allowed_keys", "dotted", "place", "sentence"]

KeyPath = tuple[str | int, ...]
Lines = Mapping[KeyPath, int]
"""Line number (from 1) of every key of a file."""

_PLAIN: Final = {
    "tuple_type": "a list, e.g. [1.0, 2.0]",
    "list_type": "a list, e.g. [1.0, 2.0]",
    "dict_type": "keys with values ('key: value')",
    "model_type": "keys with values ('key: value')",
    "model_attributes_type": "keys with values ('key: value')",
    "string_type": "text",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "float_type": "a number",
}
"""What pydantic's types are called in a YAML file."""


_LONGEST: Final = 80
"""Characters of a value that a message shows."""


def dotted(path: KeyPath) -> str:
    """Return a key path as it is written in messages: "orthosis.stiffness_range[0]"."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def place(where: str, path: KeyPath, lines: Lines) -> str:
    """Return "file, line 3: key" from what is known."""
    line = lines.get(path) or lines.get(path[:-1])
    origin = f"{where}, line {line}" if where and line else where
    return ": ".join(part for part in (origin, dotted(path)) if part)


def sentence(
    problem: ValidationError,
    mapping: Mapping[str, Any],
    model_class: type[BaseModel],
    where: str,
    error: type[InputError],
    lines: Lines,
) -> InputError:
    """Turn pydantic's list of problems into one error; unknown keys come first.

    Args:
        problem: What pydantic found.
        mapping: What was validated.
        model_class: Against what.
        where: File or origin, for the message.
        error: Class of the error.
        lines: Line numbers of the keys.
    """
    problems = sorted(problem.errors(), key=lambda item: item["type"] != "extra_forbidden")
    first: Any = problems[0]
    path = _path_in(mapping, first["loc"])
    what, allowed, mend = _clauses(first, path, model_class)
    others = sorted({dotted(_path_in(mapping, item["loc"])) for item in problems} - {dotted(path)})
    if others:
        mend = (
            f"{mend + '; ' if mend else ''}also wrong: {', '.join(o or 'the file' for o in others)}"
        )
    return error(what, where=place(where, path, lines), allowed=allowed, mend=mend)


def _path_in(mapping: Any, location: tuple[str | int, ...]) -> KeyPath:
    """Drop pydantic's own labels from a location: keep what leads somewhere in the data."""
    path: list[str | int] = []
    value = mapping
    for position, part in enumerate(location):
        inside = isinstance(value, Mapping) and part in value
        if inside or (isinstance(value, list) and isinstance(part, int) and part < len(value)):
            value = value[part]
            path.append(part)
        elif isinstance(value, Mapping) and position == len(location) - 1 and part != "[key]":
            path.append(part)
    return tuple(path)


def _clauses(problem: Any, path: KeyPath, model_class: type[BaseModel]) -> tuple[str, str, str]:
    """Return what is wrong, what is allowed and how to mend it."""
    kind, context, value = problem["type"], problem.get("ctx", {}), problem["input"]
    if kind == "pathwalker":
        return context["what"], context["allowed"], context["mend"]
    if kind == "extra_forbidden":
        known = allowed_keys(model_class, problem["loc"][:-1])
        close = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=0.5)
        mend = f"did you mean '{close[0]}'?" if close else "remove it"
        return "unknown key", ", ".join(known), mend
    if kind == "missing" and isinstance(problem["loc"][-1], int):
        return "has too few entries", "", "give one more"
    if kind == "missing":
        keys = ", ".join(allowed_keys(model_class, problem["loc"][:-1]))
        return "this key is missing", "", f"add it; keys here: {keys}"
    if kind == "json_invalid":
        return f"cannot be read: {context['error']}", "", ""
    if kind == "value_error":
        return str(context["error"]), "", ""
    if kind in ("too_long", "too_short"):
        long = kind == "too_long"
        bound = f"at most {context['max_length']}" if long else f"at least {context['min_length']}"
        return f"has {len(value)} entries", bound, ""
    message = problem["msg"][0].lower() + problem["msg"][1:]
    return f"is {_shown(value)}", _PLAIN.get(kind, message.removeprefix("input should be ")), ""


def _shown(value: Any) -> str:
    """Return a value as a message shows it: in the words of YAML, long things by their kind."""
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return str(value).lower()
    text = "a mapping" if isinstance(value, dict) else repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def allowed_keys(model_class: type[BaseModel], location: tuple[str | int, ...]) -> list[str]:
    """Return the keys that a model takes at a location inside it."""
    model: type[BaseModel] | None = model_class
    for part in location:
        field = model.model_fields.get(str(part)) if model else None
        if field is not None:
            model = _model_in(field.annotation)
    return list(model.model_fields) if model else []


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the first pydantic model inside an annotation such as `dict[str, X] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _model_in(argument)
        if found is not None:
            return found
    return None
