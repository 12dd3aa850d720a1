"""What is known about one patient: the validated content of `patient_data/<id>/patient.yaml`.

SI units and radians; angles carry the signs of `conventions` (+ankle = plantarflexion).
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, field_validator, model_validator

from pathwalker_cli.conventions import SIDES, Condition, Side
from pathwalker_cli.errors import PatientError, did_you_mean
from pathwalker_cli.io.fields import Quantity, Sides, YamlModel, invalid
from pathwalker_cli.io.yaml_file import mapping_in, read_text, validate
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient.blocks import (
    ContactPoints,
    Examination,
    FootPoints,
    OrthosisData,
    Recorded,
    RockerRadius,
    Roundness,
    SegmentLengths,
    Strengths,
    sides_of,
)
from pathwalker_cli.patient.proportions import (
    ANKLE_HEIGHT,
    CUFF_AREA,
    CUFF_HEIGHT,
    HEEL_SHARE,
    SOURCE,
    TOE_SHARE,
    TOES_SHARE,
    default_length,
)

JENSEN_AGES = Quantity(
    "years",
    4.0,
    15.0,
    "Jensen's fits start at boys of 4 years: choose age_for_regressions",
    "Jensen's fits end at boys of 15 years: choose age_for_regressions (is it in months?)",
)


@dataclass(frozen=True)
class _Origin:
    """Where a patient comes from.

    Args:
        source: The file; None of a patient that was not read.
        content: The bytes that were read: the file, and that of the orthosis if it is apart.
        recordings: Folders of recordings, a folder in each per condition; earlier ones count first.
    """

    source: Path | None = None
    content: bytes = b""
    recordings: tuple[Path, ...] = ()


class Patient(YamlModel):
    """One patient; lengths and contact points that were left out are filled in on request."""

    id: str
    description: str = ""
    sex: Literal["male", "female"]
    age: Annotated[float, Quantity("years", 0.5, 100.0, above="is it in months?")]
    age_for_regressions: Annotated[float, JENSEN_AGES] | None = None
    age_for_regressions_reason: str = ""
    body_mass: Annotated[float, Quantity("kg", 5.0, 150.0, above="is it in grams?")]
    height: Annotated[float, Quantity("m", 0.5, 2.2, above="is it in centimetres?")]
    segment_lengths: SegmentLengths = SegmentLengths()
    contact_points: ContactPoints = ContactPoints()
    rocker_radius: RockerRadius = RockerRadius()
    sole_roundness: Sides[Roundness] | None = None
    strengths: Strengths | None = None
    examination: Examination = Examination()
    orthosis: OrthosisData | None = None
    recorded: dict[Condition, Recorded] = Field(default_factory=dict)
    numbers: dict[str, Annotated[float, Quantity("SI units", -1e8, 1e8)]] = Field(
        default_factory=dict
    )
    _origin: _Origin = PrivateAttr(default=_Origin())
    _changes: tuple[str, ...] = PrivateAttr(default=())

    def __repr__(self) -> str:
        """Return who it is."""
        return f"Patient({self.id!r}, {self.age:g} years, {self.body_mass:g} kg)"

    @field_validator("id")
    @classmethod
    def _safe(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", value):
            raise invalid(
                f"is {value!r}, which is not safe as the name of a folder",
                allowed="letters, digits, - and _, at most 64, a letter or digit first",
            )
        return value

    @model_validator(mode="after")
    def _regressions(self) -> Patient:
        if self.age_for_regressions is None:
            JENSEN_AGES.check(self.age)
        elif not self.age_for_regressions_reason.strip():
            raise invalid(
                "has age_for_regressions without age_for_regressions_reason",
                mend="say why the age for Jensen's regressions differs from the age",
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _sole(cls, value: Any) -> Any:
        """Let a single sole count for the sides that wear the orthosis."""
        points = value.get("contact_points") if isinstance(value, dict) else None
        if not isinstance(points, dict) or not isinstance(sole := points.get("orthosis"), dict):
            return value
        if sole.keys() & set(SIDES):
            return value
        worn = dict.fromkeys(sides_of(value.get("orthosis")) or SIDES, sole)
        return {**value, "contact_points": {**points, "orthosis": worn}}

    @model_validator(mode="after")
    def _shoe(self) -> Patient:
        soles = self.contact_points.orthosis
        for side in self.braced("orthosis"):
            if soles is None or soles[side] is None:
                where = "contact_points.orthosis" + ("" if soles is None else f".{side}")
                raise invalid(
                    f"has an orthosis but no {where}",
                    mend="add heel and toe of the shoe's sole, [x, z] in m from the ankle",
                )
        return self

    @property
    def source(self) -> Path | None:
        """The file this was read from."""
        return self._origin.source

    @property
    def content(self) -> bytes:
        """The bytes that this was read from: the file, and that of the orthosis if it is apart."""
        return self._origin.content

    @property
    def recordings(self) -> tuple[Path, ...]:
        """Folders of recordings, a folder in each per condition; earlier ones count first."""
        return self._origin.recordings

    @property
    def regression_age(self) -> float:
        """Age for the anthropometric regressions [years]."""
        return self.age if self.age_for_regressions is None else self.age_for_regressions

    @property
    def max_isometric_torque(self) -> tuple[float, ...]:
        """Strengths [N m] in the order of `conventions.GENERATORS`.

        Raises:
            PatientError: If the file gives none.
        """
        if self.strengths is None:
            raise self._lacks("strengths", "add them, or estimate them from recordings")
        return self.strengths.vector()

    def braced(self, condition: Condition) -> tuple[Side, ...]:
        """Return the sides that wear an orthosis in a condition."""
        return () if self.orthosis is None or condition == "barefoot" else self.orthosis.sides

    def require_orthosis(self) -> OrthosisData:
        """Return the orthosis.

        Raises:
            PatientError: If the file describes none.
        """
        if self.orthosis is None:
            raise self._lacks("orthosis", "add it, or choose the barefoot condition")
        return self.orthosis

    def number(self, address: str, default: float | None = None) -> float:
        """Return the number at a place in the file, e.g. "orthosis.neutral_angle.right".

        What has no key of its own stands under its whole address in `numbers`.  The default counts
        where the file gives none.

        Raises:
            PatientError: If the file gives none there, and there is no default.
        """
        place = address.rpartition(".")[0] if address.endswith(SIDES) else address
        given = self.numbers.get(address, self.numbers.get(place))
        if given is not None:
            return given
        holder: Any = self
        for part in address.split("."):
            if isinstance(holder, int | float):  # one number for both sides
                break
            holder = holder[part] if isinstance(holder, Sides) else getattr(holder, part, None)
            if holder is None and default is not None:
                return default
            if holder is None and part == "strengths":
                raise self._lacks("strengths", "add them, or estimate them from recordings")
            if holder is None:
                raise self._lacks(part, f"add it for what needs {address}")
        return float(holder)

    def length(self, name: str, side: str | None = None) -> float:
        """Return a length of `SegmentLengths` [m], measured or from proportions.

        The side matters for what exists twice.
        """
        given = getattr(self.segment_lengths, name)
        if given is None:
            return default_length(name, self.height)
        return float(given[side or ""] if isinstance(given, Sides) else given)

    def contacts(self, condition: Condition) -> Sides[FootPoints]:
        """Return heel and toe of both feet in the foot frame.

        Raises:
            PatientError: If the patient has no orthosis and its shoe is asked for.
        """
        if condition == "barefoot":
            return self._bare_soles
        shod = self.contact_points.orthosis
        if shod is None:
            raise self._lacks("contact_points.orthosis", "add heel and toe of the shoe's sole")
        soles = self._bare_soles.given | shod.given
        return Sides[FootPoints](right=soles["right"], left=soles["left"])

    @cached_property
    def _bare_soles(self) -> Sides[FootPoints]:
        """Heel and toe of both bare feet, as given or from proportions."""
        if self.contact_points.barefoot is not None:
            return self.contact_points.barefoot
        sole = -round(ANKLE_HEIGHT * self.height, 3)
        feet = {side: self.length("foot", side) for side in SIDES}
        points = {
            side: FootPoints(heel=(HEEL_SHARE * foot, sole), toe=(TOE_SHARE * foot, sole))
            for side, foot in feet.items()
        }
        return Sides[FootPoints](**points)

    def toes_length(self, side: str) -> float:
        """Return how far the toes reach in front of the ball of the foot [m]."""
        return self.number(f"toes.length.{side}", TOES_SHARE * self.length("foot", side))

    def cuff_height(self, side: str) -> float:
        """Return how far above the ankle the cuff of the orthosis presses on the leg [m]."""
        default = CUFF_HEIGHT * self.length("shank", side)
        return self.number(f"orthosis.cuff_height.{side}", default)

    def cuff_area(self, side: str) -> float:
        """Return the area on which the cuff presses, in front or behind [m^2]."""
        default = CUFF_AREA * self.length("shank", side) ** 2
        return self.number(f"orthosis.cuff_area.{side}", default)

    @property
    def leg_length(self) -> float:
        """Mean distance from hip to sole of the straight bare leg [m]."""
        soles = self.contacts("barefoot")
        return sum(
            self.length("thigh", side)
            + self.length("shank", side)
            - (soles[side].heel[1] + soles[side].toe[1]) / 2.0
            for side in SIDES
        ) / len(SIDES)

    @property
    def filled_in(self) -> tuple[str, ...]:
        """One sentence for everything that body proportions stand in for."""
        notes = [
            f"segment length {name}: {default_length(name, self.height):g} m, from body "
            f"proportions ({SOURCE})"
            for name, given in self.segment_lengths
            if given is None
        ]
        if self.contact_points.barefoot is None:
            notes.append("contact points barefoot: from foot length and height by proportion")
        return tuple(notes)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """One sentence for everything that was filled in or overridden."""
        notes = [*self.filled_in]
        if self.sex == "female":
            notes.append(
                "segment masses: Jensen's regressions are for boys; none for girls is used"
            )
        if self.age_for_regressions is not None:
            notes.append(
                f"age for Jensen's regressions: {self.age_for_regressions:g} years instead of "
                f"{self.age:g} ({self.age_for_regressions_reason.strip()})"
            )
        return (*notes, *self._changes)

    def _lacks(self, key: str, mend: str) -> PatientError:
        where = str(self.source) if self.source else f"patient {self.id}"
        return PatientError(f"{key} is not given", where=where, mend=mend)


def shipped_patients() -> tuple[str, ...]:
    """Return the ids of the patients that come with PathWalker."""
    return tuple(sorted(p.parent.name for p in shipped("patient_data").glob("*/patient.yaml")))


def load_patient(id_or_path: str | Path, recordings: tuple[Path, ...] = ()) -> Patient:
    """Read a patient.

    Args:
        id_or_path: A shipped id, a folder with `patient.yaml`, or a YAML file.  Its `orthosis` may
            be the path of a file of its own, relative to the patient's.
        recordings: Folders of further recordings than those beside the file.

    Raises:
        PatientError: If there is no such patient or its file is refused.
    """
    path = _patient_file(id_or_path)
    text = read_text(path, PatientError)
    mapping, lines = mapping_in(text, path, PatientError)
    if isinstance(named := mapping.get("orthosis"), str):
        apart = path.parent / named
        more = read_text(apart, PatientError)
        content, places = mapping_in(more, apart, PatientError)
        orthosis = validate(
            content, OrthosisData, where=str(apart), error=PatientError, lines=places
        )
        mapping = {**mapping, "orthosis": orthosis.model_dump(mode="json", exclude_none=True)}
        text += more
    patient = validate(mapping, Patient, where=str(path), error=PatientError, lines=lines)
    patient._origin = _Origin(path, text.encode(), (path.parent / "recordings", *recordings))
    return patient


@cache
def healthy_child() -> Patient:
    """Return the healthy child that strengths are compared with."""
    return load_patient("sreenivasa2017-healthy")


def healthy_strength(name: str, body_mass: float, height: float) -> float:
    """Return a maximum isometric torque of a healthy child, the shipped one grown or shrunk [N m].

    A torque is a force, which grows with body mass [kg], times a lever, which grows with height
    [m].  The name is a field of `Strengths`.
    """
    child, same = healthy_child(), f"strengths.{name}.right"
    return child.number(same) * (body_mass * height) / (child.body_mass * child.height)


def recordings_beside(id_or_path: str | Path) -> Path:
    """Return the folder of recordings beside a patient's file, whether or not either is there."""
    if str(id_or_path) in shipped_patients():
        return shipped("patient_data") / str(id_or_path) / "recordings"
    path = Path(id_or_path)
    return (path if os.path.isdir(path) else path.parent) / "recordings"


def _patient_file(id_or_path: str | Path) -> Path:
    """Return the file that holds the patient."""
    if str(id_or_path) in shipped_patients():
        return shipped("patient_data") / str(id_or_path) / "patient.yaml"
    path = Path(id_or_path)
    if os.path.isdir(path):  # False too for what cannot be a path
        return path / "patient.yaml"
    if os.path.isfile(path):
        return path
    raise PatientError(
        f"no patient '{id_or_path}'",
        allowed=f"{', '.join(shipped_patients())}, a folder with patient.yaml, or a YAML file",
        mend=did_you_mean(path.stem, [*shipped_patients(), *_patients_beside(path)]),
    )


def _patients_beside(path: Path) -> list[str]:
    """Return the names of files, without ending, and folders that may hold a patient."""
    if not os.path.isdir(path.parent):
        return []
    folders = [file.parent.name for file in path.parent.glob("*/patient.yaml")]
    return [*folders, *(file.stem for file in path.parent.glob("*.yaml"))]
