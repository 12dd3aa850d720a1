"""YAML files in, validated models out; every refusal names file, line, key and remedy."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from pathwalker_cli.errors import ConfigError, InputError
from pathwalker_cli.io.atomic import refuse_special
from pathwalker_cli.io.refusals import KeyPath, Lines, dotted, place, sentence

Model = TypeVar("Model", bound=BaseModel)


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Safe loader, compiled if possible, in which 1e-4 is a number and dates stay text."""


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

_MOST_BYTES: Final = 1_000_000
"""Size of a file that is read; the largest shipped one has some 10 000 bytes."""
_MOST_VALUES: Final = 50_000
_DEEPEST: Final = 40
_ABYSS: Final = 1000
_OF_TAGS: Final = (ValueError, LookupError, AttributeError, TypeError)
"""What the library raises for values that do not fit an explicit tag such as `!!int`."""


def load_yaml(
    path: str | Path, model_class: type[Model], error: type[InputError] = ConfigError
) -> Model:
    """Read a YAML file and validate it.

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
    return mapping_in(read_text(path, error), path, error)


def mapping_in(
    text: str, path: str | Path, error: type[InputError] = ConfigError
) -> tuple[dict[str, Any], Lines]:
    """Return the mapping in the text of a YAML file; see `read_mapping`."""
    content, lines = _content(text, str(path), error)
    if not isinstance(content, dict):
        kind = "nothing" if content is None else f"a {type(content).__name__}"
        raise error(f"holds {kind}", where=str(path), allowed="keys with values ('key: value')")
    return content, lines


def read_value(text: str, where: str, error: type[InputError] = ConfigError) -> Any:
    """Return one value read as YAML, e.g. an override on the command line.

    Raises:
        InputError: Of class `error`, if the text is no YAML value.
    """
    try:
        return _content(text, where, error)[0]
    except error:
        raise error(f"'{text}' is not a YAML value", where=where) from None


def _content(text: str, path: str, error: type[InputError]) -> tuple[Any, Lines]:
    """Return the value in a text and the line of each of its keys."""
    lines: dict[KeyPath, int] = {}
    loader = None
    try:
        _refuse_abyss(text, path, error)
        loader = _Loader(text)
        node = loader.get_single_node()
        _find_lines(node, path, error, lines)
        return loader.construct_document(node) if node is not None else None, lines
    except yaml.MarkedYAMLError as problem:
        mark = problem.problem_mark
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        what = f"not valid YAML: {problem.problem or problem.context}"
        raise error(what, where=where, mend="check indentation, colons and quotes there") from None
    except RecursionError:
        raise _too_deep(path, error) from None
    except (yaml.YAMLError, *_OF_TAGS) as problem:
        reason = " ".join(str(problem).split())
        raise error(f"not valid YAML: {reason}", where=path) from None
    finally:
        if loader is not None:
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


def read_text(path: str | Path, error: type[InputError] = ConfigError) -> str:
    """Return the text of a file.

    Raises:
        InputError: Of class `error`, if it is missing, too large or no text.
    """
    path = Path(path)
    refuse_special(path, error)
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
        text = content.decode("utf-8") if len(content) <= _MOST_BYTES else None
    except FileNotFoundError:
        raise error("no such file", where=str(path), mend="check the path") from None
    except UnicodeDecodeError:
        raise error("is not text in UTF-8", where=str(path), mend="save it as UTF-8") from None
    except OSError as problem:
        raise error(problem.strerror or "cannot be read", where=str(path)) from None
    except ValueError as problem:
        raise error(f"is no path: {problem}", where=str(path)) from None
    if text is None:
        what = f"is larger than {_MOST_BYTES // 1_000_000} MB"
        raise error(what, where=str(path), mend="is it the right file?")
    return text


def _find_lines(
    node: yaml.Node | None,
    where: str,
    error: type[InputError],
    lines: dict[KeyPath, int],
    prefix: KeyPath = (),
) -> None:
    """Add the line of every key below a node; refuse a key that stands twice, and too much.

    Aliases count as often as they are used: a few lines of them may stand for billions of values.
    """
    if len(prefix) > _DEEPEST:
        raise _too_deep(where, error)
    if len(lines) > _MOST_VALUES:
        what = f"holds more than {_MOST_VALUES} values, aliases counted wherever they stand"
        raise error(what, where=where, mend="is it the right file?")
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
            _find_lines(value, where, error, lines, path)
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            lines[(*prefix, index)] = item.start_mark.line + 1
            _find_lines(item, where, error, lines, (*prefix, index))


def _refuse_abyss(text: str, where: str, error: type[InputError]) -> None:
    """Refuse levels of which the compiled loader, which calls itself for each, would die."""
    depth = 0
    for event in yaml.parse(text, _Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _ABYSS:
            raise _too_deep(where, error)


def _too_deep(where: str, error: type[InputError]) -> InputError:
    return error("is nested too deep", where=where, allowed=f"at most {_DEEPEST} levels")


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
        path = _not_finite(item, (*prefix, key))
        if path:
            return path
    return ()


def yaml_text(content: Mapping[str, Any], heading: str) -> str:
    """Return content as YAML below a comment of one line."""
    return f"# {heading}\n{yaml.safe_dump(content, sort_keys=False, allow_unicode=True)}"
