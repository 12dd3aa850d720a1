"""The springs that a report recommends, and how sure they are."""

from __future__ import annotations

from typing import Final

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.report.content import Fact, Row, Section, Table
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.verdict import NOT_DETERMINED, SHARE, NumberVerdict, Verdict
from pathwalker_cli.studies.verdict.words import (
    PRESCRIBED,
    number_text,
    per_degree,
    reservations,
    snapped_warning,
    stop_text,
)

_HEAD: Final = (
    "spring", "fit: [N m/rad] ([N m/deg])", "does as well: [N m/rad] ([N m/deg])",
    "least effort: [N m/rad]", "how sure",
)  # fmt: skip
_ANY: Final = "any of the drawer: choose by fitting"

_NOT_JUDGED: Final = (
    "The springs of this run were not judged (verdict: false, or a quick check): the table shows "
    "those of least effort only."
)
_NO_CHOICE: Final = "The config prescribes all springs: nothing was identified."


def spring_section(run: ReportRun) -> Section:
    """Return the springs of a run with orthoses: real ones to fit, region, verdict."""
    verdict = run.verdict
    rows = tuple(_row(run, name) for name in run.springs)
    note = (
        "K_D resists dorsiflexion (the shin leaning forward), K_P plantarflexion (the foot "
        f"pointing down); does as well: the cost stays within {100 * SHARE:g} % of the best, all "
        "else optimal"
    )
    free = any(not prescribed(run, name) for name in run.springs)
    lines = (_NOT_JUDGED if free else _NO_CHOICE,) if verdict is None else ()
    facts = tuple(_facts(verdict)) if verdict else ()
    table = Table(_HEAD, rows, notes=(note,), columns="wwnnp")
    named = "" if run.label == run.run.config.condition else f", {run.label}"
    return Section(f"Springs to fit{named}", lines, facts, (table,))


def recommended(run: ReportRun) -> dict[str, float]:
    """Return the springs to take [N m/rad]: real ones where the run chose among them."""
    snapped = run.verdict.snapped if run.verdict else None
    chosen = snapped.stiffness if snapped else {}
    return {name: chosen.get(name, _identified(run, name)) for name in run.springs}


def left_open(run: ReportRun, name: str) -> bool:
    """Return whether the verdict found that a spring hardly matters."""
    spring = _judged(run, name)
    return spring is not None and spring.determined == NOT_DETERMINED


def _judged(run: ReportRun, name: str) -> NumberVerdict | None:
    springs = run.verdict.springs if run.verdict else ()
    return next((spring for spring in springs if spring.name == name), None)


def verdict_words(spring: NumberVerdict) -> str:
    """Return in words how sure a spring is."""
    if spring.prescribed:
        return PRESCRIBED
    if not spring.limit:
        return spring.determined
    end = {"upper": "stiffest", "lower": "softest"}[spring.limit]
    return f"{spring.determined}; at the limit of what can be bought ({end})"


def _identified(run: ReportRun, name: str) -> float:
    stiffness = run.evaluation.gait.stiffness
    if stiffness is None:
        raise ValueError(f"{run.label} wears no orthoses")
    return float(stiffness[STIFFNESSES.index(name)])


def _row(run: ReportRun, name: str) -> Row:
    take, identified, verdict = recommended(run)[name], _identified(run, name), run.verdict
    spring = _judged(run, name)
    snapped = verdict.snapped.names.get(name, "") if verdict and verdict.snapped else ""
    region, words = "-", PRESCRIBED if prescribed(run, name) else "not judged"
    if spring is not None:
        words = verdict_words(spring)
    if spring is not None and not spring.prescribed:
        low, high = spring.region
        region = f"{low:.1f} to {high:.1f} ({per_degree(low):.2f} to {per_degree(high):.2f})"
    fit = f"{snapped}: ".lstrip(": ") + f"{take:.1f} ({per_degree(take):.2f})"
    fit = _ANY if left_open(run, name) else fit
    cells = (measure_of(name).label, fit, region, f"{identified:.1f}", words)
    return Row(cells, "good" if snapped else "")


def prescribed(run: ReportRun, name: str) -> bool:
    """Return whether a run had no choice of a spring."""
    low, high = (run.run.metrics.get("stiffness_ranges") or {}).get(name, (0.0, 1.0))
    return bool(low == high)


def _facts(verdict: Verdict) -> list[Fact]:
    """Return what the table has no room for."""
    snapped = verdict.snapped
    if snapped is None:
        real = "the patient's file lists none that can be bought (orthosis.springs)"
    elif snapped.status == "converged":
        names = ", ".join(f"{measure_of(n).label} {s}" for n, s in snapped.names.items())
        real = (
            f"solved again with {names}: cost {100 * snapped.rise:+.2g} %, "
            f"{snapped.walking_speed:.3f} m/s"
        )
        real = ". ".join(filter(None, (real, snapped_warning(verdict))))
    else:
        real = f"estimated cost {100 * snapped.rise:+.2g} % (solving it: {snapped.status})"
    if verdict.starts > 1:
        others = f"{len(verdict.optima) - 1} of {verdict.starts - 1} other starts end within 5 %"
    else:
        others = "not searched for (starts: 8 does)"
    facts = [Fact("Real springs", real), Fact("Other optima", others)]
    if verdict.numbers:
        also = ". ".join(f"{number.label}: {number_text(number)}" for number in verdict.numbers)
        facts.insert(0, Fact("Other numbers that were free", also))
    doubts = [
        f"{measure_of(s.name).label}: {'; '.join(doubts_of)}"
        for s in verdict.springs
        if (doubts_of := list(reservations(s)))
    ]
    if doubts:
        facts.append(Fact("Limits and doubts", ". ".join(doubts)))
    reached = [stop_text(stop) for stop in verdict.stops if stop.excess > 0.0]
    facts.append(Fact("Hard stops", "; ".join(reached) or "none is reached"))
    return facts
