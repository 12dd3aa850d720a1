"""What a perturbation found: one row per spring that was moved, with the reason of its change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.springs import Ranges

__all__ = ["Perturbation", "Perturbed", "remark"]


@dataclass(frozen=True)
class Perturbed:
    """One spring moved.

    Args:
        spring: Its name.
        factor: Its stiffness over that of the optimum.
        stiffness: Its stiffness [N m/rad].
        status: How the solve of everything else ended.
        values: Measures of the gait that results, SI units; empty if it did not converge.
        changes: Their change over the optimum's value, as a share.
        falls: Whether the cost falls by more than the solves are exact to.
        note: Why the cost changes as it does, "" if there is nothing to say.
        unexplained: Whether the cost falls although the optimum could have had this spring.
        iterations: Iterations of the solve.
        seconds: Wall seconds of the solve.
    """

    spring: str
    factor: float
    stiffness: float
    status: str
    values: Mapping[str, float]
    changes: Mapping[str, float]
    falls: bool
    note: str
    unexplained: bool
    iterations: int
    seconds: float

    @property
    def label(self) -> str:
        """Name for people, e.g. "K_D left x 0.95"."""
        return f"{measure_of(self.spring).label} x {self.factor:g}"


@dataclass(frozen=True)
class Perturbation:
    """All springs moved.

    Args:
        config: The config of the optimum.
        patient: Id of the patient.
        intervals: Mesh intervals of all solves.
        base: Measures of the optimum, SI units.
        ranges: Allowed range by spring [N m/rad].
        rows: One per spring and factor.
        seconds: Wall seconds in all, the solve of the optimum from nothing apart.
    """

    config: StudyConfig
    patient: str
    intervals: int
    base: Mapping[str, float]
    ranges: Ranges
    rows: tuple[Perturbed, ...]
    seconds: float

    @property
    def failed(self) -> tuple[Perturbed, ...]:
        """Those that did not converge."""
        return tuple(row for row in self.rows if not row.values)

    @property
    def better(self) -> tuple[Perturbed, ...]:
        """Those that show that the optimum is none."""
        return tuple(row for row in self.rows if row.unexplained)


def remark(
    end: str, stiffness: float, limits: tuple[float, float], fall: float
) -> tuple[str, bool]:
    """Return what to know about a moved spring, and whether its cost may fall.

    Args:
        end: "lower" or "upper" if the optimum sits at that end of the range, else "".
        stiffness: Stiffness that is prescribed [N m/rad].
        limits: The range [N m/rad].
        fall: Change of the cost, as a share, if it falls; 0 otherwise.
    """
    low, high = limits
    limit = {"lower": low, "upper": high}.get(end)
    at = "" if limit is None else f"the optimum sits at its {end} limit of {limit:g} N m/rad; "
    outside = "softer" if stiffness < low else "stiffer" if stiffness > high else ""
    if outside:
        result = "the cost falls" if fall else "the cost may fall"
        real = f"{stiffness:.4g} N m/rad is {outside} than any in [{low:g}, {high:g}]"
        return f"{at}{real}: {result}", True
    if fall:
        return f"{at}no true optimum: better by {-100.0 * fall:.2g} %", False
    if limit is not None:
        return f"{at}moving into the range raises the cost in proportion", False
    return "", False
