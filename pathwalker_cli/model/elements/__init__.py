"""Force elements: all that pulls or pushes at the joints, and the one sum of generalised forces.

An element says which coordinates it acts on, which named numbers it needs, and how large its forces
are in one expression that takes NumPy arrays and CasADi symbols alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from pathwalker_cli.errors import ConfigError
from pathwalker_cli.installed import load_installed
from pathwalker_cli.model.numbers import Number

Curve = Callable[..., Any]
"""Evaluates a scalar function at its arguments, e.g. `plain`, or by a stand-in whose derivatives
cost less."""


def plain(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return a function's value itself."""
    return function(*arguments)


@dataclass(frozen=True)
class State:
    """What elements may depend on, by name; numbers, arrays of instants, or CasADi expressions.

    Args:
        q: Generalised coordinates [m, rad].
        v: Generalised velocities [m/s, rad/s].
        activation: Activations of the muscle torque generators, in [0, 1].
    """

    q: Mapping[str, Any]
    v: Mapping[str, Any]
    activation: Mapping[str, Any]


class ForceElement(Protocol):
    """One force element."""

    @property
    def name(self) -> str:
        """Its name, unique in a walker."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The generalised coordinates that it acts on."""

    @property
    def numbers(self) -> tuple[Number, ...]:
        """The named numbers that it needs."""

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return its generalised force on each of its coordinates [N, N m].

        `numbers` are values by address; `curve` evaluates what is costly to differentiate.
        """


REGISTERED: Final[dict[str, tuple[ForceElement, ...]]] = {}
"""Elements from outside by the name that configs call them, see `extensions`."""


def registered_elements(names: Iterable[str]) -> tuple[ForceElement, ...]:
    """Return the elements that were registered by these names.

    Raises:
        ConfigError: If nothing has registered one of them.
    """
    for name in names:
        if name not in REGISTERED:
            load_installed()
        if name not in REGISTERED:
            raise ConfigError(
                f"names '{name}', which nothing has registered",
                where="model.elements",
                allowed=", ".join(REGISTERED) or "none: nothing has registered any",
                mend="import what registers it first, or install its package",
            )
    return tuple(element for name in names for element in REGISTERED[name])


def element_forces(
    elements: Iterable[ForceElement], state: State, numbers: Mapping[str, Any], curve: Curve = plain
) -> list[Any]:
    """Return the forces of all elements in a row, each on its coordinates in order [N, N m]."""
    return [force for element in elements for force in element.forces(state, numbers, curve)]


def generalised_forces(
    elements: Iterable[ForceElement], forces: Sequence[Any], coordinates: Sequence[str], zero: Any
) -> list[Any]:
    """Return the sum of the forces on every coordinate: the only such sum there is.

    Forces are those that `element_forces` returns; `zero` stands where nothing acts.
    """
    sums: dict[str, Any] = {}
    acted_on = (name for element in elements for name in element.coordinates)
    for name, force in zip(acted_on, forces, strict=True):
        sums[name] = sums[name] + force if name in sums else force
    return [sums.get(name, zero) for name in coordinates]
