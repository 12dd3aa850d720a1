"""YAML files in, validated models out; every refusal names file, line, key and remedy."""

from __future__ import annotations

import difflib
import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from pathwalker_cli.errors import ConfigError, InputError

__all__ = ["KeyPath", "Lines", "load_yaml", "read_mapping", "validate"]

Model = TypeVar("Model", bound=BaseModel)
KeyPath = tuple[str | int, ...]
Lines = Mapping[KeyPath, int]
"""Line number (from 1) of every key of a file."""


class _Loader(yaml.SafeLoader):
    """Safe loader in which 1e-4 is a number and dates stay text."""


_FLOAT = re.compile(
    r"[-+]?(?:\d[\d_]*\.?[\d_]*(?:[eE][-+]?\d+)|\d[\d_]*\.[\d_]*|\.\d[\d_]*(?:[eE][-+]?\d+)?"
    r"|\.(?:inf|Inf|INF))$|\.(?:nan|NaN|NAN)$"
)
_Loader.yaml_implicit_resolvers = {
    first: [
        (tag, pattern)
        for tag, pattern in resolvers
        if tag not in ("tag:yaml.org,2002:float", "tag:yaml.org,2002:timestamp")
    ]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789."))


def load_yaml(
    path: str | Path, model_class: type[Model], error: type[InputError] = ConfigError
) -> Model:
    """Read a YAML file and validate it.

    Args:
        path: The file.
        model_class: Pydantic model of its content.
        error: Class of the error to raise.

    Raises:
        InputError: Of class `error`, if the file cannot be read or its content is refused.
    """
    mapping, lines = read_mapping(path, error)
    return validate(mapping, model_class, where=str(path), error=error, lines=lines)


def read_mapping(
    path: str | Path, error: type[InputError] = ConfigError
) -> tuple[dict[str, Any], Lines]:
    """Return the mapping in a YAML file and the line of each of its keys.

    Raises:
        InputError: Of class `error`, if the file is missing, is not YAML, repeats a key, or holds
            anything but a mapping of names to values.
    """
    text = _text(Path(path), error)
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        lines = _lines(node, str(path), error)
        content = loader.construct_document(node) if node is not None else None
    except yaml.MarkedYAMLError as problem:
        mark = problem.problem_mark
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        what = f"not valid YAML: {problem.problem or problem.context}"
        raise error(what, where=where, mend="check indentation, colons and quotes there") from None
    except (yaml.YAMLError, ValueError, RecursionError) as problem:
        reason = " ".join(str(problem).split())
        raise error(f"not valid YAML: {reason}", where=str(path)) from None
    finally:
        loader.dispose()
    if not isinstance(content, dict):
        found = "nothing" if content is None else f"a {type(content).__name__}"
        raise error(f"holds {found}", where=str(path), allowed="keys with values ('key: value')")
    return content, lines


def validate(
    mapping: Mapping[str, Any],
    model_class: type[Model],
    *,
    where: str = "",
    error: type[InputError] = ConfigError,
    lines: Lines | None = None,
) -> Model:
    """Validate a mapping strictly (no text for numbers, no NaN) into a model.

    Args:
        mapping: What was read.
        model_class: Pydantic model of it.
        where: File or origin, for the message.
        error: Class of the error to raise.
        lines: Line numbers of the keys, from `read_mapping`.

    Raises:
        InputError: Of class `error`, one sentence about the first thing that is wrong.
    """
    try:
        text = json.dumps(mapping, allow_nan=False)
    except TypeError as problem:
        raise error(f"holds a value of another kind: {problem}", where=where) from None
    except ValueError:
        key = _not_finite(mapping)
        place = _place(where, key, lines or {})
        raise error("is not a finite number", where=place, allowed="a finite number") from None
    try:
        return model_class.model_validate_json(text, strict=True)
    except ValidationError as problem:
        raise _sentence(problem, mapping, model_class, where, error, lines or {}) from None


def _text(path: Path, error: type[InputError]) -> str:
    """Return the text of a file."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise error("no such file", where=str(path), mend="check the path") from None
    except UnicodeDecodeError:
        raise error("is not text in UTF-8", where=str(path), mend="save it as UTF-8") from None
    except OSError as problem:
        raise error(problem.strerror or "cannot be read", where=str(path)) from None


def _lines(
    node: yaml.Node | None, where: str, error: type[InputError], prefix: KeyPath = ()
) -> dict[KeyPath, int]:
    """Return the line of every key below a node; refuse a key that stands twice."""
    lines: dict[KeyPath, int] = {}
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            path = (*prefix, str(key.value))
            line = key.start_mark.line + 1
            if key.tag == "tag:yaml.org,2002:merge":
                raise error(
                    "merge keys are not read",
                    where=f"{where}, line {line}",
                    mend="write the keys out",
                )
            if path in lines:
                raise error(
                    f"key {dotted(path)} stands twice, first in line {lines[path]}",
                    where=f"{where}, line {line}",
                    mend="remove one of them",
                )
            lines[path] = line
            lines.update(_lines(value, where, error, path))
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            lines[(*prefix, index)] = item.start_mark.line + 1
            lines.update(_lines(item, where, error, (*prefix, index)))
    return lines


def dotted(path: KeyPath) -> str:
    """Return a key path as it is written in messages: "orthosis.stiffness_range[0]"."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _not_finite(value: Any, prefix: KeyPath = ()) -> KeyPath:
    """Return the path of the first number that is NaN or infinite."""
    items: Any = ()
    if isinstance(value, Mapping):
        items = value.items()
    elif isinstance(value, list | tuple):
        items = enumerate(value)
    elif isinstance(value, float) and not math.isfinite(value):
        return prefix
    for key, item in items:
        found = _not_finite(item, (*prefix, key))
        if found:
            return found
    return ()


def _place(where: str, path: KeyPath, lines: Lines) -> str:
    """Return "file, line 3: key" from what is known."""
    line = lines.get(path) or lines.get(path[:-1])
    origin = f"{where}, line {line}" if where and line else where
    return ": ".join(part for part in (origin, dotted(path)) if part)


def _sentence(
    problem: ValidationError,
    mapping: Mapping[str, Any],
    model_class: type[BaseModel],
    where: str,
    error: type[InputError],
    lines: Lines,
) -> InputError:
    """Turn pydantic's list of problems into one sentence; unknown keys come first."""
    problems = sorted(problem.errors(), key=lambda item: item["type"] != "extra_forbidden")
    first: Any = problems[0]
    path = _path_in(mapping, first["loc"])
    what, allowed, mend = _clauses(first, path, model_class)
    others = sorted({dotted(_path_in(mapping, item["loc"])) for item in problems} - {dotted(path)})
    if others:
        mend = (
            f"{mend + '; ' if mend else ''}also wrong: {', '.join(o or 'the file' for o in others)}"
        )
    return error(what, where=_place(where, path, lines), allowed=allowed, mend=mend)


def _path_in(mapping: Any, location: tuple[str | int, ...]) -> KeyPath:
    """Drop pydantic's own labels from a location: keep what leads somewhere in the data."""
    path: list[str | int] = []
    value = mapping
    for position, part in enumerate(location):
        inside = isinstance(value, Mapping) and part in value
        if inside or (isinstance(value, list) and isinstance(part, int) and part < len(value)):
            value = value[part]
            path.append(part)
        elif isinstance(value, Mapping) and position == len(location) - 1:
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
    if kind == "missing":
        keys = ", ".join(allowed_keys(model_class, problem["loc"][:-1]))
        return "this key is missing", "", f"add it; keys here: {keys}"
    shown = "a mapping" if isinstance(value, dict) else repr(value)
    if kind == "value_error":
        return str(context["error"]), "", ""
    message = problem["msg"][0].lower() + problem["msg"][1:]
    return f"is {shown}", message.removeprefix("input should be "), ""


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
