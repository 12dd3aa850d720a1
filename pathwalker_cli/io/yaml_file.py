"""YAML files in, validated models out; every refusal names file, line, key and remedy."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from pathwalker_cli.errors import ConfigError, InputError
from pathwalker_cli.io.refusals import KeyPath, Lines, dotted, place, sentence

__all__ = ["KeyPath", "Lines", "load_yaml", "read_mapping", "validate", "yaml_text"]

Model = TypeVar("Model", bound=BaseModel)


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


def read_value(text: str, where: str, error: type[InputError] = ConfigError) -> Any:
    """Return one value read as YAML, e.g. an override on the command line.

    Raises:
        InputError: Of class `error`, if the text is no YAML value.
    """
    loader = _Loader(text)
    try:
        return loader.get_single_data()
    except (yaml.YAMLError, ValueError, RecursionError):
        raise error(f"'{text}' is not a YAML value", where=where) from None
    finally:
        loader.dispose()


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
        position = place(where, key, lines or {})
        raise error("is not a finite number", where=position, allowed="a finite number") from None
    try:
        return model_class.model_validate_json(text, strict=True)
    except ValidationError as problem:
        raise sentence(problem, mapping, model_class, where, error, lines or {}) from None


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


def yaml_text(content: Mapping[str, Any], heading: str) -> str:
    """Return content as YAML below a comment.

    Args:
        content: Plain values by key.
        heading: One line that says what it is.
    """
    return f"# {heading}\n{yaml.safe_dump(content, sort_keys=False, allow_unicode=True)}"
