"""Numbers of a patient's file that are allowed and unusual: a sentence each, nothing is refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from pathwalker_cli.conventions import GRAVITY, SIDES
from pathwalker_cli.patient import OrthosisData, Patient
from pathwalker_cli.patient.proportions import SOURCE, default_length

__all__ = ["odd_orthosis", "odd_patient", "odd_speed"]

_BODY_MASS_INDEX: Final = (11.0, 40.0)
"""[kg/m^2] Wider than three standard deviations at any age in de Onis et al. (2007), Development of
a WHO growth reference for school-aged children and adolescents."""

_FACTOR: Final = 1.25
"""Children's thighs are down to 1 / 1.18 of the adults' share of height (shipped patients)."""

_FROUDE: Final = 0.5
"""Where walking turns to running: Kram, Domingo and Ferris (1997), Effect of reduced gravity on
the preferred walk-run transition speed."""


def odd_patient(patient: Patient) -> Iterator[str]:
    """Yield sentences about size, lengths and springs."""
    index = patient.body_mass / patient.height**2
    low, high = _BODY_MASS_INDEX
    if not low <= index <= high:
        yield (
            f"body_mass {patient.body_mass:g} kg at height {patient.height:g} m is a body mass "
            f"index of {index:.1f} kg/m2; {low:g} to {high:g} is wider than three standard "
            "deviations of the WHO growth reference at any age (de Onis et al. 2007)"
        )
    for name in ("thigh", "shank", "foot"):
        yield from _length(patient, name)
    if patient.orthosis is not None:
        yield from odd_orthosis(patient.orthosis, "orthosis.")


def _length(patient: Patient, name: str) -> Iterator[str]:
    """Yield a sentence for each side whose length is far from body proportions."""
    usual = default_length(name, patient.height)
    for side in SIDES:
        length = patient.length(name, side)
        if not 1.0 / _FACTOR <= length / usual <= _FACTOR:
            yield (
                f"segment_lengths.{name} {side} {length:g} m is {length / usual:.2f} times what "
                f"body proportions give for {patient.height:g} m of height, {usual:g} m "
                f"({SOURCE}); up to {_FACTOR:g} times longer or shorter is usual"
            )


def odd_orthosis(orthosis: OrthosisData, prefix: str = "") -> Iterator[str]:
    """Yield a sentence for each real spring that the range of the search leaves out.

    Args:
        orthosis: The orthosis.
        prefix: What stands before its keys in the file.
    """
    if orthosis.springs is None:
        return
    for kind in ("dorsiflexion", "plantarflexion"):
        low, high = getattr(orthosis.stiffness_range, kind)
        for spring in getattr(orthosis.springs, kind):
            if not low <= spring.stiffness <= high:
                yield (
                    f"{prefix}springs.{kind} '{spring.name}' of {spring.stiffness:g} N m/rad lies "
                    f"outside {prefix}stiffness_range.{kind} [{low:g}, {high:g}], "
                    f"{orthosis.stiffness_range.source}; usually the range spans all real springs"
                )


def odd_speed(patient: Patient, speed: float, source: str) -> Iterator[str]:
    """Yield a sentence about a speed at which nobody of this size walks.

    Args:
        patient: Who walks.
        speed: Walking speed [m/s].
        source: What asks for it.
    """
    leg = patient.leg_length
    froude = speed**2 / (GRAVITY * leg)
    if froude > _FROUDE:
        most = (_FROUDE * GRAVITY * leg) ** 0.5
        yield (
            f"{source} is a Froude number v^2/(g leg length) of {froude:.2f} for legs of "
            f"{leg:.3g} m; above {_FROUDE:g}, here {most:.2f} m/s, people run (Kram et al. 1997)"
        )
