"""One case: a patient and a config, read and validated once; from here on it is what travels."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pathwalker_cli.config import StudyConfig, load_config, with_values
from pathwalker_cli.config.schema import plain_use
from pathwalker_cli.errors import PatientError
from pathwalker_cli.io.yaml_file import yaml_text
from pathwalker_cli.model.contact import AS_RECORDED, HEEL_TOE
from pathwalker_cli.model.skeleton import SIDES
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.patient.variation import varied

if TYPE_CHECKING:
    from pathwalker_cli.model.parts import Parts
    from pathwalker_cli.model.walker import Walker


@dataclass(frozen=True)
class Case:
    """What is solved, and for whom.

    Args:
        config: The config.
        unvaried: The patient as in the file, before the variation of the config; it knows the
            bytes that it was read from, and where its recordings stand.
    """

    config: StudyConfig
    unvaried: Patient

    def __repr__(self) -> str:
        """Return what is solved, and for whom."""
        return f"Case({self.config.problem!r}, {self.unvaried.id!r})"

    @classmethod
    def of(cls, study: StudyConfig | Case) -> Case:
        """Return the case of a config, whose patient is read now; a case stays what it is.

        Raises:
            PatientError: If there is no such patient, or its file is refused.
            ConfigError: If the variation does not fit the patient.
        """
        if isinstance(study, Case):
            return study
        try:
            case = cls(study, load_patient(study.patient))
        except PatientError as error:
            raise error.at(error.where or "patient") from None
        _ = case.patient  # what does not fit is refused here, where it is read
        return case.landed

    @property
    def landed(self) -> Case:
        """The case with feet that land as their recordings show, where the config asks for that.

        Raises:
            DataError: If no recording shows it.
            ConfigError: If the config does not suit what they show.
        """
        model = self.config.model
        if AS_RECORDED not in model.uses:
            return self
        from pathwalker_cli.model.landing import recorded_use  # takes long: only who needs it
        from pathwalker_cli.model.walker import walker_of

        parts = replace(self.parts, contact=HEEL_TOE, toes=False)
        walker = walker_of(self.patient, parts, model.published)
        uses = {
            side: plain_use(recorded_use(walker, side) if use == AS_RECORDED else use)
            for side, use in zip(SIDES, model.uses, strict=True)
        }
        return self.with_values({"model.contact": uses})

    @cached_property
    def patient(self) -> Patient:
        """The patient with the variation of the config.

        Raises:
            ConfigError: If the variation does not fit the patient.
            PatientError: If the patient that results is refused.
        """
        return varied(self.unvaried, self.config.variation, self.config.numbers)

    @property
    def parts(self) -> Parts:
        """What the walker is made of."""
        from pathwalker_cli.model.parts import Parts  # takes long: only who needs it

        model, condition = self.config.model, self.config.condition
        return Parts(
            condition, model.tissue, model.feet, model.uses, model.elements,
            self.patient.braced(condition), model.toes, model.orthosis,
        )  # fmt: skip

    def walker(self, backend: str = "auto") -> Walker:
        """Return the walking model of the patient in the condition of the problem.

        Args:
            backend: Dynamics back end, see `model.backends`.

        Raises:
            PatientError: If the patient lacks strengths or an orthosis that is worn.
            ConfigError: If a number is to be free that does not exist.
        """
        from pathwalker_cli.model.walker import walker_of  # takes long: only who needs it

        free = tuple(self.config.free)
        model, friction = self.config.model, self.config.bounds.friction
        return walker_of(self.patient, self.parts, model.published, backend, free, friction)

    def with_values(self, values: Mapping[str, Any], where: str = "") -> Case:
        """Return the case with other values in its config; see `config.with_values`.

        The patient is read anew only if the values name another one.
        """
        config = with_values(self.config, values, where)
        if config.patient != self.config.patient:
            return Case.of(config)
        return replace(self, config=config).landed

    @property
    def content_hash(self) -> str | None:
        """SHA-256 of the bytes that the patient was read from; None if it was not read."""
        if self.unvaried.source is None:
            return None
        return hashlib.sha256(self.unvaried.content).hexdigest()

    @property
    def patient_text(self) -> str:
        """The patient before any variation as YAML in one piece, the orthosis in its place."""
        content = self.unvaried.model_dump(mode="json", exclude_none=True)
        return yaml_text(content, "The patient of this run, before any variation of the config.")


def config_text(config: StudyConfig) -> str:
    """Return a config with all defaults filled in, as YAML that `load_config` reads."""
    return yaml_text(config.model_dump(mode="json"), "The config of this run, every value written.")


def load_case(path: str | Path, problem: str = "", changes: tuple[str, ...] = ()) -> Case:
    """Read a config and its patient.

    Args:
        path: The config, a YAML file or the name of a shipped one, e.g. "mapd-orthosis".
        problem: Problem that was asked for; it must be the config's own.
        changes: Overrides "dotted.key=value", as from the command line.

    Raises:
        ConfigError: If file or overrides are wrong.
        PatientError: If there is no such patient, or its file is refused.
    """
    config = load_config(path, problem, changes)
    try:
        return Case.of(config)
    except PatientError as error:
        raise error.at(f"{path}, patient" if error.where == "patient" else error.where) from None
