"""What `metrics.json` of a run must hold, as far as anything relies on it when it is read back."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["RunMetrics"]

Number = float | None
"""A number; None for what JSON does not know."""


class RunMetrics(BaseModel):
    """Kinds of the entries that are read; further ones may be anything."""

    model_config = ConfigDict(extra="allow")

    problem: str
    status: str
    condition: str
    motion_hash: str
    effort: Number
    cost: Number
    patient: str | None = None
    date: str | None = None
    start: str | None = None
    kernels: str | None = None
    warm_start: str | None = None
    walking_speed: Number = None
    second_engine_residual: Number = None
    reintegration_position_error: Number = None
    reintegration_velocity_error: Number = None
    seconds_solve: float = 0.0
    intervals: int | None = None
    iterations: int | None = None
    active_bounds: list[str] | None = None
    notes: list[str] | None = None
    bound_sources: dict[str, str] | None = None
    versions: dict[str, str | None] = Field(default_factory=dict)
    input_hashes: dict[str, str | None] = Field(default_factory=dict)
    multipliers_hash: str | None = None
    verdict: dict[str, Any] | None = None
