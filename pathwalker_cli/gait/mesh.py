"""Mesh intervals: as many as the duration of a phase asks for, more where they are inaccurate."""

from __future__ import annotations

import time

import numpy as np

from pathwalker_cli.config import MeshConfig
from pathwalker_cli.gait import choices
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.cost_error import CostError, cost_error
from pathwalker_cli.stride.verify import Reintegration, reintegrate


def uniform(counts: np.ndarray | list[int]) -> tuple[np.ndarray, ...]:
    """Return equally spaced nodes in [0, 1], one array per phase."""
    return tuple(np.linspace(0.0, 1.0, int(count) + 1) for count in counts)


def first(durations: np.ndarray, config: MeshConfig) -> tuple[np.ndarray, ...]:
    """Return the mesh that a config begins with, for phases of these durations [s]."""
    if isinstance(config.intervals, tuple):
        return uniform(list(config.intervals[: len(durations)]))
    return by_duration(durations, config.intervals, config.least_intervals_per_phase)


def by_duration(
    durations: np.ndarray, intervals: int, least_per_phase: int
) -> tuple[np.ndarray, ...]:
    """Return a mesh of so many, about equally long intervals for phases of these durations [s].

    Short phases, which get the fewest that are allowed, may bring in a few more.
    """
    shares = intervals * np.asarray(durations) / np.sum(durations)
    return uniform(np.maximum(np.ceil(shares), least_per_phase).astype(int).tolist())


def costly(shares: tuple[np.ndarray, ...], allowed: float) -> tuple[np.ndarray, ...]:
    """Return which intervals have to be split until the others change the cost by less.

    Args:
        shares: What halving every interval would change the cost by, shape (N,) each.
        allowed: Change of the cost that may be left.
    """
    size = np.abs(np.concatenate(shares))
    order = np.argsort(size)
    split = np.zeros(size.shape, bool)
    split[order] = np.cumsum(size[order]) > allowed
    return tuple(np.split(split, np.cumsum([len(part) for part in shares])[:-1]))


def refined(
    meshes: tuple[np.ndarray, ...],
    errors: Reintegration,
    costly: tuple[np.ndarray, ...],
    config: MeshConfig,
    share: float = 1.0,
) -> tuple[np.ndarray, ...]:
    """Return a mesh in which intervals above a share of the tolerances are split.

    The degree is the order of the error in the length of an interval.

    Args:
        meshes: Node positions of every phase.
        errors: Errors of an independent integrator on it.
        costly: Which intervals are split for the cost, shape (N,) each; see `costly`.
        config: The tolerances.
        share: The share of them.
    """
    result = []
    for mesh, position, velocity, dear in zip(
        meshes, errors.position, errors.velocity, costly, strict=True
    ):
        ratio = np.maximum(
            position / config.position_tolerance, velocity / config.velocity_tolerance
        )
        parts = np.ceil(np.clip(choices.AIM * ratio, 1e-9, 1e6) ** (1.0 / config.degree))
        parts = np.where(ratio > share, np.clip(parts, 2, choices.MOST_PARTS), 1).astype(int)
        parts = np.maximum(parts, np.where(dear, 2, 1))
        pieces = [
            np.linspace(mesh[i], mesh[i + 1], n + 1)[:-1] for i, n in enumerate(parts.tolist())
        ]
        result.append(np.concatenate([*pieces, [1.0]]))
    return tuple(result)


class MeshJudge:
    """Judges the meshes of solved stages: by an independent integrator, and by what they cost.

    Args:
        walker: Who walks.
        config: What a mesh must reach.
        seconds: Wall seconds by part of the solve; what judging takes is added to "verify".
    """

    def __init__(self, walker: Walker, config: MeshConfig, seconds: dict[str, float]) -> None:
        self._walker, self._config, self._seconds = walker, config, seconds
        self._estimated: tuple[NlpResult, CostError | None] | None = None

    def errors(
        self,
        program: CollocationProgram,
        result: NlpResult,
        tolerance: float = choices.PROVING_TOLERANCE,
    ) -> Reintegration:
        """Return the errors of an independent integrator of this relative tolerance."""
        began = time.perf_counter()
        errors = reintegrate(self._walker, program.to_motion(result.unknowns), tolerance)
        self._seconds["verify"] += time.perf_counter() - began
        return errors

    def accepts(self, errors: Reintegration) -> bool:
        """Return whether the errors of an integrator are within what is allowed."""
        return (
            errors.worst_position <= self._config.position_tolerance
            and errors.worst_velocity <= self._config.velocity_tolerance
        )

    def cost_error(self, program: CollocationProgram, result: NlpResult) -> CostError | None:
        """Return what halving every interval would change the cost by, estimated once."""
        if self._estimated is None or self._estimated[0] is not result:
            began = time.perf_counter()
            self._estimated = result, cost_error(program, result)
            self._seconds["verify"] += time.perf_counter() - began
        return self._estimated[1]

    def costly(self, program: CollocationProgram, result: NlpResult) -> tuple[np.ndarray, ...]:
        """Return which intervals have to be split for the cost; none where it cannot be told."""
        error = self.cost_error(program, result)
        allowed = self._config.cost_tolerance * abs(result.objective)
        if error is None or _small(error, allowed):
            return tuple(np.zeros(len(mesh) - 1, bool) for mesh in program.meshes)
        return costly(error.shares, choices.COST_AIM * allowed)


def _small(error: CostError, allowed: float) -> bool:
    """Return whether an estimated change of the cost is no reason to split an interval."""
    size = sum(np.abs(part).sum() for part in error.shares)
    sure = abs(error.total) <= choices.COST_SURE * allowed and size <= choices.COST_SIZE * allowed
    return bool(sure or size <= allowed)
