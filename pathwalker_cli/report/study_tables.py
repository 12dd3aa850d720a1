"""Studies around the optimum of a run as tables of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Final

import numpy as np

from pathwalker_cli.conventions import STIFFNESSES, to_degrees
from pathwalker_cli.errors import DataError
from pathwalker_cli.report.content import Row, Section, Table
from pathwalker_cli.report.figures import drawn
from pathwalker_cli.report.folders import Study
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.report.springs import recommended
from pathwalker_cli.report.summaries import (
    LandscapeSummary,
    LearnSummary,
    PerturbationSummary,
    SensitivitySummary,
    TradeoffSummary,
    UncertaintySummary,
    landscape_of,
    spreads_of,
)
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measure_of, measures_in
from pathwalker_cli.studies.landscape.figures import Chosen, cost_figure
from pathwalker_cli.studies.landscape.result import Landscape
from pathwalker_cli.studies.measures import COMPARED, Ranges
from pathwalker_cli.studies.registry import STUDIES
from pathwalker_cli.studies.sensitivity.result import SHOWN, elasticity_text, label_of
from pathwalker_cli.studies.tradeoff.figures import tradeoff_figure
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff
from pathwalker_cli.studies.uncertainty.figures import spread_figure
from pathwalker_cli.studies.uncertainty.result import Spread, shown_text, span_text, span_words

_RANKED: Final = 10
"""Numbers whose sensitivity is shown, the strongest."""


def study_section(study: Study, run: ReportRun) -> Section:
    """Return table and figure of a study.

    Raises:
        DataError: If its files are not those that the command wrote.
    """
    try:
        return _section(study, run)
    except (LookupError, TypeError, AttributeError, ValueError, StopIteration) as problem:
        what = f"does not hold what `pathwalker {study.kind}` writes: {problem!r}"
        raise DataError(what, where=str(study.folder), mend="make the study again") from None


def _section(study: Study, run: ReportRun) -> Section:
    match study.summary:
        case SensitivitySummary() as summary:
            return _sensitivity(summary)
        case PerturbationSummary() as summary:
            return _perturbation(summary)
        case LandscapeSummary() as summary:
            return _landscape(landscape_of(summary, study.folder), run)
        case TradeoffSummary(root=tradeoff):
            return _tradeoff(tradeoff)
        case UncertaintySummary() as summary:
            return _uncertainty(summary, *spreads_of(summary, study.folder))
        case LearnSummary() as summary:
            return _learnt(summary)
    entry = STUDIES[study.kind]  # pages draw no table of it, but say where its numbers stand
    return Section(entry.heading, (f"{entry.title} Its numbers: {study.folder / entry.summary}.",))


def _sensitivity(summary: SensitivitySummary) -> Section:
    """Return what a change of every number does, strongest first, in words and as numbers."""
    measures = measures_in("studies")
    walking = [m.key for m in measures if m.key not in STIFFNESSES]  # springs may be open
    sizes = {
        place: max((abs(values.get(key) or 0.0) for key in walking), default=0.0)
        for place, values in summary.elasticities.items()
    }
    ranked = [p for p in sorted(sizes, key=sizes.__getitem__, reverse=True) if sizes[p] >= SHOWN]
    elasticities = {place: summary.elasticities[place] for place in ranked[:_RANKED]}
    shown = [m for m in measures if any(_moves(v.get(m.key)) for v in elasticities.values())]
    rows = tuple(
        Row((label_of(place), *(elasticity_text(values.get(m.key)) for m in shown)))
        for place, values in elasticities.items()
    )
    left = len(ranked) - len(rows)
    table = Table(
        ("one per cent more of", *(m.short for m in shown)),
        rows,
        caption="Elasticities at the optimum, % per %; a spring moves with the others following",
        notes=(
            f"a dot is less than {SHOWN:g}; {left} numbers that move less stand in sensitivity.csv",
            "beyond a change of the active set the numbers no longer hold",
        ),
    )
    words = tuple(_in_words(place, values, shown) for place, values in elasticities.items())
    return Section("Sensitivity, strongest first", tables=(table,), points=words)


def _in_words(place: str, values: Mapping[str, float | None], measures: Sequence[Measure]) -> str:
    """Return in a sentence what ten per cent more of a number do, the two strongest first."""
    known = {m.label: values.get(m.key) or 0.0 for m in measures if m.key not in STIFFNESSES}
    if any(map(_moves, (size for label, size in known.items() if label != "cost"))):
        known.pop("cost", None)
    most = sorted(known, key=lambda label: abs(known[label]), reverse=True)[:2]
    moved = " and ".join(f"{label} by {10.0 * known[label]:+.1f} %" for label in most)
    name = label_of(place)
    return f"{name[:1].upper()}{name[1:]}: 10 % more changes {moved}"


def _moves(value: float | None) -> bool:
    """Return whether an elasticity is worth showing."""
    return value is not None and abs(value) >= SHOWN


def _perturbation(summary: PerturbationSummary) -> Section:
    rows = []
    for row in summary.rows:
        name = row.label if row.spring is None else measure_of(row.spring).label
        # springs in the unit of the column, others in their own
        moved_to = f"{row.value:.4g} {row.unit}" if row.spring is None else f"{row.stiffness:.1f}"
        label = f"{name} {100.0 * (row.factor - 1.0):+.3g} %"
        cells = (label, moved_to, *(_change(row.changes.get(key)) for key in COMPARED), row.note)
        rows.append(Row(cells, "" if row.status == "converged" else "failed"))
    head = ("spring", "[N m/rad]", *(f"{measure_of(key).short} [%]" for key in COMPARED), "remark")
    columns = f"wn{'n' * len(COMPARED)}p"
    caption = "Changes when one spring is moved and all the rest is optimal again"
    table = Table(head, tuple(rows), caption, columns=columns)
    return Section("Perturbation of the springs", tables=(table,))


def _change(share: float | None) -> str:
    # adding 0.0 makes +0.00 of -0.00
    return "no solution" if share is None else f"{round(100.0 * share, 2) + 0.0:+.2f}"


def _landscape(landscape: Landscape, run: ReportRun) -> Section:
    """Return the cost over K_D and K_P as a map, with the region of nearly best springs."""
    orthosis = run.patient.orthosis
    springs = None if orthosis is None else orthosis.springs
    best, region = landscape.best, landscape.region
    lines = [
        f"Least cost at K_D {best.k_d:.1f}, K_P {best.k_p:.1f} N m/rad ({_side(landscape.side)})."
    ]
    if region is not None:
        lines.append(
            f"Within {100 * landscape.tolerance:g} % of it: K_D {region.k_d[0]:.1f} to "
            f"{region.k_d[1]:.1f}, K_P {region.k_p[0]:.1f} to {region.k_p[1]:.1f} N m/rad, "
            f"{100 * region.share:.0f} % of the grid points."
        )
    top = np.nanmax(landscape.increase)
    lines.append(f"The most expensive point costs {100 * top:.1f} % more than the best.")
    if landscape.branched:
        lines.append(
            f"Several local optima at {len(landscape.branched)} of {len(landscape.bests)} points."
        )
    if landscape.failed:
        lines.append(f"No solution at {len(landscape.failed)} of {len(landscape.bests)} points.")
    figure = partial(cost_figure, landscape, springs, _chosen(run, landscape.side))
    title = "Cost above the least [%] over K_D and K_P [N m/rad]"
    drawing = drawn(figure, "landscape", title, "tall")
    return Section("Landscape of the springs", tuple(lines), drawings=(drawing,))


def _chosen(run: ReportRun, side: str) -> Chosen:
    """Return the real springs to take of a side, or of both."""
    if run.verdict is None or run.verdict.snapped is None:
        return {}
    springs = recommended(run)
    return {
        s: (springs[f"dorsiflexion_stiffness_{s}"], springs[f"plantarflexion_stiffness_{s}"])
        for s in run.braced
        if side in (s, "both")
    }


def _side(side: str) -> str:
    return "both sides tied" if side == "both" else f"{side} side"


def _tradeoff(tradeoff: Tradeoff) -> Section:
    """Return the front of speed and effort, and the springs along it."""
    springs = tradeoff.springs
    head = ("weight of speed [s^2/m^2]", "speed [m/s]", "effort [s/m]",
            *(f"{measure_of(name).short} [N m/rad]" for name in springs), "remark")  # fmt: skip
    rows = []
    for point in tradeoff.points:
        if point.solved:
            numbers = [f"{point.speed:.3f}", f"{point.effort:.3f}"]
            numbers += [f"{point.measures[name]:.1f}" for name in springs]
        else:
            numbers = ["-"] * (2 + len(springs))
        cells = (f"{point.walking_speed_weight:g}", *numbers, _remark(point))
        rows.append(Row(cells, "" if point.solved else "failed"))
    table = Table(head, tuple(rows), columns=f"w{'n' * (len(head) - 2)}p")
    lines = [
        "How much effort a faster gait takes: the objective weighs speed more and more. A "
        "dominated point is no faster and no cheaper than another one."
    ]
    title = "Effort per distance [s/m] and springs [N m/rad] over walking speed [m/s]"
    figure = partial(tradeoff_figure, tradeoff)
    drawings = (drawn(figure, "tradeoff", title, "tall"),) if tradeoff.solved else ()
    return Section("Trade-off of speed and effort", tuple(lines), tables=(table,),
                   drawings=drawings)  # fmt: skip


def _remark(point: FrontPoint) -> str:
    """Return what to know about a point of a front, "" for nothing."""
    if not point.solved:
        return point.status
    remarks = ["dominated"] * bool(point.dominated)
    remarks += ["mesh too coarse: rough numbers"] * (point.mesh == "inaccurate")
    return "; ".join(remarks)


def _uncertainty(
    summary: UncertaintySummary, values: Mapping[str, np.ndarray], spreads: Sequence[Spread]
) -> Section:
    """Return how far springs and gait spread when the patient's numbers are uncertain."""
    count = summary.draws - len(summary.failed)
    head = ("", "unit", "base", "median", span_words(count), "follows most")
    rows = (_spread_row(each, values, summary) for each in spreads)
    lines = [f"{summary.draws} draws of the uncertain numbers, {count} converged."]
    lines += [words for each in spreads if (words := _chance(each, summary.ranges))]
    lines += summary.advice
    title = "Springs of all draws [N m/rad], and deviation of cost and gait from the base [%]"
    figure = partial(spread_figure, values, summary.ranges, spreads)
    drawings = (drawn(figure, "uncertainty", title, "tall"),) if count else ()
    table = Table(head, tuple(rows), columns="wwnnnp")
    return Section("Uncertainty of the patient's numbers", tuple(lines), tables=(table,),
                   drawings=drawings)  # fmt: skip


def _learnt(summary: LearnSummary) -> Section:
    own = summary.rms_own_cycles
    fit = ", ".join(
        f"{joint} {to_degrees(rms):.1f} ({to_degrees(own.get(joint, np.nan)):.1f})"
        for joint, rms in summary.rms_mean_cycle.items()
    )
    lines = (
        f"Learnt from {summary.condition} strides. RMS difference to the mean recorded cycle, in "
        f"brackets that of single recorded cycles [deg]: {fit}.",
        f"Ranges that hold the result: {', '.join(summary.active_bounds) or 'none'}.",
    )
    rows = tuple(
        Row((place, each.unit, f"{each.learnt:.3g}", " to ".join(f"{x:.3g}" for x in each.interval),
             f"{each.prior:.3g}", f"{100.0 * each.told:.0f}"))
        for place, each in summary.numbers.items()
    )  # fmt: skip
    head = ("", "unit", "learnt", "one deviation", "prior", "told by strides [%]")
    table = Table(head, rows, columns="wwnnnn")
    return Section("What the strides say of body and cost", lines, tables=(table,))


def _spread_row(
    spread: Spread, values: Mapping[str, np.ndarray], summary: UncertaintySummary
) -> Row:
    measure, key = spread.measure, spread.measure.key
    strongest = summary.spreads[key].strongest_input
    span = span_text(spread, values.get(key, np.empty(0)), summary.ranges.get(key))
    return Row((
        measure.label, measure.shown_unit,
        shown_text(measure, spread.base), shown_text(measure, spread.quantiles[1]), span,
        label_of(strongest) if strongest else "-",
    ))  # fmt: skip


def _chance(spread: Spread, ranges: Ranges) -> str:
    """Return in words how often a spring sits at a limit, "" for other measures."""
    key, label, unit = spread.measure.key, spread.measure.label, spread.measure.unit
    if key not in ranges:
        return ""
    low, high = ranges[key]
    if low == high:
        return f"{label} is prescribed: {low:g} {unit}."
    if spread.lower is None or spread.upper is None:
        return ""
    inside = 1.0 - spread.lower - spread.upper
    most, least = ("stiffest", "softest") if key in STIFFNESSES else ("largest", "least")
    parts = [(spread.upper, f"the {most} ({high:g} {unit})"),
             (spread.lower, f"the {least} ({low:g} {unit})"),
             (inside, "one between")]  # fmt: skip
    shares = ", ".join(f"{words} in {100 * share:.0f} %" for share, words in parts if share > 0.0)
    return f"{label}: least effort takes {shares} of the draws."
