"""A verification as lines for the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from pathwalker_cli.verification.checks import Check, Verification

__all__ = ["verification_lines"]


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
    amount = _amount(check)
    note = f"  {check.note}" if check.note and not check.passed else ""
    return f" {state:<8}{check.name:<26}{amount}{note}".rstrip()


def _amount(check: Check) -> str:
    if check.limit == 0.0:
        return "as written" if check.passed else ""
    return f"{check.value:.1e} of {check.limit:.0e} {check.unit}"
