"""Goals, measures, force elements and patterns of contact from outside: a script's or a package's.

A script registers them before it reads a config; a package does so where an entry point of the
group `pathwalker` says, see `installed`.
"""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from typing import Final, get_args

from pathwalker_cli.errors import InputError
from pathwalker_cli.gait import costs
from pathwalker_cli.gait.costs import CostTerm
from pathwalker_cli.model import elements
from pathwalker_cli.model.contact import USES, Posture, Use
from pathwalker_cli.model.elements import ForceElement
from pathwalker_cli.stride import measures
from pathwalker_cli.stride.measure import Measure

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")


def register_goal(name: str, term: CostTerm) -> None:
    """Let configs weigh a goal of this name in `cost.goals`.

    Args:
        name: Its name; its running costs must have names that no other term has.
        term: Its running costs and its value, see `gait.costs`.

    Raises:
        InputError: If the name is none or taken, or a running cost has the name of another one.
    """
    _require_new(name, "goal", costs.GOALS)
    taken = {i for known in (*costs.BASE.values(), *costs.GOALS.values()) for i in known.integrals}
    if twice := taken.intersection(term.integrals):
        raise InputError(f"has a running cost '{min(twice)}', as another term has",
                         where=f"goal {name}", allowed="names of its own")  # fmt: skip
    costs.GOALS[name] = term


def register_measure(measure: Measure) -> None:
    """Let every result, table and study have a measure.

    Raises:
        InputError: If its key is none or taken.
    """
    _require_new(measure.key, "measure", [known.key for known in measures.REGISTRY])
    measures.REGISTRY = (*measures.REGISTRY, measure)


def register_elements(name: str, parts: Sequence[ForceElement]) -> None:
    """Let configs give a body force elements by this name, in `model.elements`.

    Args:
        name: What configs call them.
        parts: The elements, e.g. one per side.

    Raises:
        InputError: If the name is none or taken.
    """
    _require_new(name, "element", elements.REGISTERED)
    elements.REGISTERED[name] = tuple(parts)


def register_use(name: str, single: Sequence[Posture], landing: Sequence[Posture]) -> None:
    """Let configs use a foot in a pattern of this name, in `model.contact`.

    Runs keep what it stands for: they are read without it.

    Args:
        name: What configs call it.
        single: What of the foot is on the ground while the other one swings, in order.
        landing: What of it is after it has landed, until the other one leaves the ground.

    Raises:
        InputError: If the name is none or taken, or no foot can do this.
    """
    _require_new(name, "use", USES)
    use = Use(tuple(single), tuple(landing))
    if strangers := {*use.single, *use.landing} - set(get_args(Posture)):
        raise InputError(f"names '{min(strangers)}'", where=f"use {name}",
                         allowed="heel, flat, toe")  # fmt: skip
    if use.fault:
        raise InputError(use.fault, where=f"use {name}")
    USES[name] = use


def _require_new(name: str, kind: str, known: Container[str]) -> None:
    if not _NAME.fullmatch(name):
        raise InputError(f"'{name}' is no name of a {kind}",
                         allowed="small letters, digits and underscores")  # fmt: skip
    if name in known:
        raise InputError(f"there is a {kind} '{name}' already", mend="choose another name")
