"""How two runs of the same config differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pathwalker_cli.results.run_folder import Run

__all__ = ["difference_lines"]


def difference_lines(before: Run, after: Run) -> Iterator[str]:
    """Yield in words how a run that was solved again differs from the one before."""
    if before.metrics.get("warm_start"):
        yield f"the run before began with {before.metrics['warm_start']}; this one did not"
    versions = [
        run.metrics["versions"] | {"kernels": run.metrics.get("kernels")} for run in (before, after)
    ]
    for name in _different(*versions):
        yield f"{name}: {versions[0].get(name)} before, {versions[1].get(name)} now"
    if before.metrics["motion_hash"] == after.metrics["motion_hash"]:
        yield "the motion is the same to the last bit"
        return
    costs = before.metrics["cost"], after.metrics["cost"]
    yield f"cost {costs[0]:.9g} before, {costs[1]:.9g} now"
    meshes = zip(before.motion.meshes, after.motion.meshes, strict=True)
    if all(np.array_equal(one, two) for one, two in meshes):
        apart = max(
            float(np.abs(one.states - two.states).max())
            for one, two in zip(before.motion.phases, after.motion.phases, strict=True)
        )
        yield f"states differ by {apart:.2e} rad, m, rad/s or m/s at most"
    else:
        yield f"{before.motion.intervals} mesh intervals before, {after.motion.intervals} now"


def _different(one: Mapping[str, Any], two: Mapping[str, Any]) -> list[str]:
    return [name for name in sorted({*one, *two}) if one.get(name) != two.get(name)]
