"""One clear sentence out of what pydantic says about a refused mapping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from pathwalker_cli.errors import InputError, did_you_mean
from pathwalker_cli.io.fields import models_in

KeyPath = tuple[str | int, ...]
Lines = Mapping[KeyPath, int | str]
"""Line number (from 1) of every key of a file, or the override that stands in its place."""

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
    """Return "file, line 3: key" from what is known, or "--set key=value" for an override."""
    above = [path[:end] for end in range(len(path), 0, -1)]
    for key in above:
        if isinstance(override := lines.get(key), str):
            return override if key == path else f"{override}: {dotted(path)}"
    line = next((lines[key] for key in above[:2] if key in lines), None)
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
    """Turn pydantic's list of problems into one error; unknown keys come first."""
    problems = sorted(problem.errors(), key=lambda item: item["type"] != "extra_forbidden")
    first: Any = problems[0]
    path = _path_in(mapping, first["loc"])
    what, allowed, mend = _alternatives(
        [item for item in problems if _path_in(mapping, item["loc"]) == path], path, model_class
    )
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


def _alternatives(
    problems: Sequence[Any], path: KeyPath, model_class: type[BaseModel]
) -> tuple[str, str, str]:
    """Return what is wrong with one value, what is allowed and how to mend it.

    Several problems of one value are those of the kinds that it might be of, e.g. a word or a
    number: all that is allowed is told.
    """
    clauses = [_clauses(problem, path, model_class) for problem in problems]
    if len(set(clauses)) == 1:  # one value may count for both sides
        return clauses[0]
    value = problems[0]["input"]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    units = [c for p, c in zip(problems, clauses, strict=True) if p["type"] == "pathwalker"]
    what, _, mend = units[0] if number and units else (f"is {_shown(value)}", "", "")
    # A unit alone does not say that a number is meant where words are allowed too.
    allowed = [f"a number, {text}" if c in units else text for c in clauses if (text := c[1])]
    return what, " or ".join(dict.fromkeys(allowed)), mend


def _clauses(problem: Any, path: KeyPath, model_class: type[BaseModel]) -> tuple[str, str, str]:
    """Return what is wrong, what is allowed and how to mend it."""
    kind, context, value = problem["type"], problem.get("ctx", {}), problem["input"]
    if kind == "pathwalker":
        return context["what"], context["allowed"], context["mend"]
    if kind == "extra_forbidden":
        known = allowed_keys(model_class, problem["loc"][:-1])
        mend = did_you_mean(str(path[-1]), known, otherwise="remove it")
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
            model = next(iter(models_in(field.annotation)), None)
    return list(model.model_fields) if model else []
