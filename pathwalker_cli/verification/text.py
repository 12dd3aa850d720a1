"""A verification as lines for the terminal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.verification.checks import Check, Verification


def verification_lines(verification: Verification) -> Iterator[str]:
    """Yield a heading, one line per check, and the outcome."""
    patient = f", patient {verification.patient}" if verification.patient else ""
    yield f"{verification.folder}: {verification.problem}{patient}"
    for check in verification.checks:
        yield _line(check)
    failed = [check.name for check in verification.checks if not check.passed]
    yield f"NOT in order: {', '.join(failed)}" if failed else "All checks passed."


def _line(check: Check) -> str:
    if check.value is None:
        return f" -       {check.name:<26}{check.note}"
    state = "ok" if check.passed else "FAILED"
    amount = f"{check.value:.1e} of {check.limit:.0e} {check.unit}"
    if check.limit == 0.0:
        amount = "as written" if check.passed else ""
    note = f"  {check.note}" if check.note and not check.passed else ""
    return f" {state:<8}{check.name:<26}{amount}{note}".rstrip()


def difference_lines(before: Run, after: Run) -> Iterator[str]:
    """Yield in words how a run that was solved again differs from the one before."""
    if before.metrics.get("warm_start"):
        yield f"the run before began with {before.metrics['warm_start']}; this one did not"
    versions = [
        run.metrics["versions"] | {"kernels": run.metrics.get("kernels")} for run in (before, after)
    ]
    for name in sorted({*versions[0], *versions[1]}):
        then, now = (each.get(name) for each in versions)
        if then != now:
            yield f"{name}: {then} before, {now} now"
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
