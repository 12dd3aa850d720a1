"""Configs of the studies of recorded gait: which trials, which method, which choices."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import Field, field_validator, model_validator

# The lookup of files, overrides and patients is the same for all configs.
from pathwalker_cli.config import patient_path, place_of, read_config
from pathwalker_cli.conventions import CONDITIONS, Condition
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.inverse.dynamics import MOTION_CUTOFF
from pathwalker_cli.inverse.markers import LONGEST_GAP
from pathwalker_cli.io.fields import Quantity, YamlModel, invalid

Config = TypeVar("Config", bound="RecordedConfig")


class Paths(YamlModel):
    """C3D files, or folders of them, per condition."""

    barefoot: tuple[str, ...] = ()
    orthosis: tuple[str, ...] = ()

    def of(self, condition: Condition) -> tuple[str, ...]:
        """Return the paths of one condition."""
        return self.orthosis if condition == "orthosis" else self.barefoot


class RecordedConfig(YamlModel):
    """What both studies of recorded gait choose."""

    patient: str
    conditions: tuple[Condition, ...] = CONDITIONS
    c3d: Paths = Paths()
    markers: str | None = None
    subject: str | None = None
    mend_plates: bool = False
    longest_gap: Annotated[float, Quantity("s", 0.0, 1.0, above="is it in frames?")] = LONGEST_GAP
    largest_marker_distance: Annotated[float, Quantity("body heights", 0.001, 1.0)] = 0.025

    @field_validator("conditions")
    @classmethod
    def _some(cls, value: tuple[Condition, ...]) -> tuple[Condition, ...]:
        if not value or len(set(value)) != len(value):
            raise invalid("is empty or names one twice", allowed=", ".join(CONDITIONS))
        return value

    @property
    def recorded_conditions(self) -> tuple[Condition, ...]:
        """Conditions of which C3D files are named."""
        return tuple(condition for condition in self.conditions if self.c3d.of(condition))

    def require_c3d(self, where: str) -> None:
        """Refuse a config that names no C3D file."""
        if not self.recorded_conditions:
            raise ConfigError(
                f"names no C3D file of {' or '.join(self.conditions)}",
                where=f"{where}: c3d",
                allowed="lists of files or folders per condition",
                mend=f"add them there or by --set c3d.{self.conditions[0]}=[FOLDER]",
            )


class InverseKinematicsConfig(RecordedConfig):
    """Joint angles from markers."""

    study: Literal["inverse-kinematics"]


class InverseDynamicsConfig(RecordedConfig):
    """Joint torques, residuals and strengths from motion and ground forces."""

    study: Literal["inverse-dynamics"]
    source: Literal["recordings", "c3d"] = "recordings"
    trials: tuple[str, ...] = ()
    method: Literal["default", "published"] = "default"
    motion_cutoff: Annotated[float, Quantity("Hz", 1.0, 50.0)] = MOTION_CUTOFF
    tissue: bool = False
    least_frames: Annotated[int, Field(ge=1, le=10000)] = 20
    least_stances: Annotated[int, Field(ge=1, le=1000)] = 3
    angle_error: Annotated[float, Quantity("rad", 0.0, 0.5, above="is it in degrees?")] = 0.09
    speed_error: Annotated[float, Quantity("rad/s", 0.0, 5.0)] = 0.5
    largest_sensitivity: Annotated[float, Quantity("", 0.0, 10.0)] = 0.15
    largest_residual: Annotated[float, Quantity("body weights", 0.0, 1.0)] = 0.15

    @model_validator(mode="after")
    def _raw(self) -> InverseDynamicsConfig:
        if self.method == "published" and self.source != "c3d":
            raise invalid(
                "asks for method published from recordings, which lack the plates' channels",
                allowed="source c3d with method published",
                mend="set source to c3d and name the files below c3d",
            )
        return self


def load_inverse_kinematics(
    path: str | Path, changes: tuple[str, ...] = ()
) -> InverseKinematicsConfig:
    """Read the config of an inverse kinematics study, as `load_inverse_dynamics` does.

    Raises:
        ConfigError: If file or overrides are wrong, or no C3D file is named.
    """
    config = _load(path, changes, InverseKinematicsConfig)
    config.require_c3d(str(path))
    return config


def load_inverse_dynamics(path: str | Path, changes: tuple[str, ...] = ()) -> InverseDynamicsConfig:
    """Read a config, a file or a shipped name, with overrides "dotted.key=value".

    Raises:
        ConfigError: If file or overrides are wrong, or source is c3d and no file is named.
    """
    config = _load(path, changes, InverseDynamicsConfig)
    if config.source == "c3d":
        config.require_c3d(str(path))
    return config


def _load(path: str | Path, changes: tuple[str, ...], model_class: type[Config]) -> Config:
    """Read a config; its paths count from its own folder, those of overrides from here."""
    config, source = read_config(path, model_class, changes)

    def placed(file: str, key: str) -> str:
        folders = (place_of(key, source, changes), source.parent, Path())
        there = (folder / file for folder in folders if os.path.exists(folder / file))
        return str(next(there, file))

    paths = {
        condition: tuple(placed(file, f"c3d.{condition}") for file in config.c3d.of(condition))
        for condition in config.conditions
    }
    changed = {
        "patient": patient_path(config.patient, place_of("patient", source, changes)),
        "c3d": Paths(**paths),
        "markers": placed(config.markers, "markers") if config.markers else None,
    }
    return config.model_copy(update=changed)
