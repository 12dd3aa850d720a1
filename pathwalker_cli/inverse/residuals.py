"""Residual forces on the pelvis: how well motion, forces and body fit together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.conventions import ROOT

__all__ = ["ResidualRange", "Residuals", "residual_range", "residuals"]


@dataclass(frozen=True)
class Residuals:
    """Residuals of one trial, per component: forward [N], up [N], moment [N m].

    Args:
        trial: Name of the trial.
        mean: Means over the frames, shape (3,).
        rms: Root mean squares over the frames, shape (3,).
        frames: Number of frames in which both feet's forces are known.
    """

    trial: str
    mean: np.ndarray
    rms: np.ndarray
    frames: int


@dataclass(frozen=True)
class ResidualRange:
    """Mean, lowest and highest of the trials' mean residuals, each of shape (3,)."""

    mean: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray


def residuals(trial: str, tau: np.ndarray, frames: np.ndarray | None = None) -> Residuals:
    """Return the residuals of a trial over the frames in which they are known.

    Args:
        trial: Name of the trial.
        tau: Generalised forces [N, N m], NaN where a force is not measured, shape (n, 10).
        frames: Frames to look at; all if left out.
    """
    root = (tau if frames is None else tau[frames])[:, : len(ROOT)]
    known = root[np.isfinite(root).all(axis=1)]
    if not known.size:
        nothing = np.full(len(ROOT), np.nan)
        return Residuals(trial, nothing, nothing, 0)
    return Residuals(trial, known.mean(axis=0), np.sqrt((known**2).mean(axis=0)), len(known))


def residual_range(found: tuple[Residuals, ...], per: float = 1.0) -> ResidualRange:
    """Return mean and extremes over trials that have any known frame.

    Args:
        found: Residuals of the trials.
        per: Mass to divide by [kg]; the published table 3 gives N/kg and N m/kg as N and N m.
    """
    means = np.array([item.mean for item in found if item.frames]) / per
    return ResidualRange(means.mean(axis=0), means.min(axis=0), means.max(axis=0))
