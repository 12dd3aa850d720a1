"""Named numbers: every number of a part of the walker, by its place in the patient's file.

One mechanism for all that can happen to a number: it is fixed, an unknown of a problem, or varied
by a study.  What a number is stands here; what it is worth for a patient stands in the file.  A
number that both sides share there exists once per side in the walker, so that it can be chosen for
one side, for each, or for both alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pathwalker_cli.errors import ConfigError, did_you_mean
from pathwalker_cli.model.choices import UNIT_SIZES
from pathwalker_cli.model.skeleton import SIDES, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient


@dataclass(frozen=True)
class Number:
    """One number of a part.

    Args:
        address: Its place in the patient's file, the side last where it belongs to one, e.g.
            "orthosis.neutral_angle.right" or "strengths.lumbar_flexion".
        name: A short name for tables and unknowns, without side, e.g. "neutral_angle".
        label: The name for people, e.g. "neutral angle".
        unit: SI unit.
        side: The side that it belongs to.
        default: Its value where the patient's file gives none, or how it follows from the patient;
            None where the file has to give it.
        source: Where the default comes from.
        faded: Whether the first stage of a solve lets only a share of it act: torques that would
            fight a stride that knows nothing of them.
    """

    address: str
    name: str
    label: str
    unit: str
    side: Side | None = None
    default: float | Callable[[Patient], float] | None = None
    source: str = ""
    faded: bool = False

    def value_for(self, patient: Patient) -> float:
        """Return what it is worth for a patient [unit]."""
        default = self.default(patient) if callable(self.default) else self.default
        return patient.number(self.address, default)

    @property
    def place(self) -> str:
        """The address without its side."""
        return self.address if self.side is None else self.address.removesuffix(f".{self.side}")

    @property
    def full_name(self) -> str:
        """The name with its side, e.g. "neutral_angle_right"."""
        return self.name if self.side is None else f"{self.name}_{self.side}"


@dataclass(frozen=True)
class Unknown:
    """A number that a problem is free to choose, or several that shall be equal.

    Args:
        name: Name of the unknown, e.g. "neutral_angle_right", or "neutral_angle" for both sides.
        address: The place in the patient's file under which a config frees or holds it.
        label: The name for people, e.g. "K_D right".
        numbers: The numbers that it sets, all in one unit.
        scale: What counts as 1 for the solver [unit].
    """

    name: str
    address: str
    label: str
    numbers: tuple[Number, ...]
    scale: float

    @classmethod
    def of(cls, *numbers: Number, address: str = "") -> Unknown:
        """Return the unknown that sets one number, or those of both sides alike.

        Its address is that of the number if left out, or the place that both sides share.
        """
        first, alone = numbers[0], len(numbers) == 1
        label = f"{first.label} {first.side}" if alone and first.side else first.label
        name = first.full_name if alone else first.name
        address = address or (first.address if alone else first.place)
        return cls(name, address, label, numbers, UNIT_SIZES.get(first.unit, 1.0))

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.numbers[0].unit

    @property
    def side(self) -> Side | None:
        """The side that it belongs to; None for both sides alike and for the midline."""
        return self.numbers[0].side if len(self.numbers) == 1 else None

    @property
    def addresses(self) -> tuple[str, ...]:
        """Addresses of the numbers."""
        return tuple(number.address for number in self.numbers)

    def value(self, values: Mapping[str, float]) -> float:
        """Return its value among those of a walker, of several the mean [unit]."""
        return float(np.mean([values[address] for address in self.addresses]))

    @property
    def faded(self) -> bool:
        """See `Number.faded`."""
        return self.numbers[0].faded


def unknowns_at(addresses: Iterable[str], numbers: Sequence[Number]) -> tuple[Unknown, ...]:
    """Return the unknowns that stand for these addresses; one without side stands for both alike.

    Raises:
        ConfigError: If there is no such number, or one is asked for twice.
    """
    chosen: list[Unknown] = []
    taken: set[str] = set()
    for address in addresses:
        matching = [n for n in numbers if address in (n.address, n.place)]
        if not matching:
            known = sorted({n.place for n in numbers})
            place, _, side = address.rpartition(".")
            if place in known and side in SIDES:
                raise ConfigError(
                    f"names '{address}', but the {side} side has none",
                    where="free",
                    allowed=" or ".join(n.address for n in numbers if n.place == place),
                )
            sides = f"; with .{' or .'.join(SIDES)} behind it for one side of what exists twice"
            raise ConfigError(
                f"names '{address}', which is no number of this walker",
                where="free",
                allowed=", ".join(known) + sides,
                mend=did_you_mean(address, known),
            )
        unknown = Unknown.of(*matching, address=address)
        if twice := taken.intersection(unknown.addresses):
            raise ConfigError(
                f"names {min(twice)} twice", where="free",
                allowed="both sides alike, or each side once",
            )  # fmt: skip
        taken.update(unknown.addresses)
        chosen.append(unknown)
    return tuple(chosen)
