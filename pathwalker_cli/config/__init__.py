"""Study configs: what they hold, how they are read, and how single values are overridden."""

from __future__ import annotations

from pathwalker_cli.config.files import (
    config_content,
    find_config,
    load_config,
    patient_path,
    place_of,
    read_config,
)
from pathwalker_cli.config.overrides import apply_change, smoke_version, with_values
from pathwalker_cli.config.schema import (
    BoundsConfig,
    CostConfig,
    MeshConfig,
    ModelConfig,
    SolverConfig,
    StartConfig,
    StudyConfig,
)

__all__ = [
    "BoundsConfig",
    "CostConfig",
    "MeshConfig",
    "ModelConfig",
    "SolverConfig",
    "StartConfig",
    "StudyConfig",
    "apply_change",
    "config_content",
    "find_config",
    "load_config",
    "patient_path",
    "place_of",
    "read_config",
    "smoke_version",
    "with_values",
]
