"""What a run says on the terminal: summary, proof, bounds, times, orthosis, and why it failed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, Literal

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pathwalker_cli.conventions import SIDES, STIFFNESSES, SUFFIX, to_degrees
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum, Shortfall
from pathwalker_cli.model.skeleton import EVERY_JOINT
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.patient import OrthosisData
from pathwalker_cli.stride.measures import TABLES, expanded, measure_of, measures_in
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.stride.unusual import unusual

_AT_LIMIT: Final = 1e-3
"""Share of its range within which a value counts as sitting at a limit: interior-point solvers
stay a little away from every bound, by far less than this."""

_EXACT: Final = 1e-3
"""Residual of the equations of motion up to which forces count as exact [N, N m]."""

_WISH: Final = {"upper": "stiffer", "lower": "softer"}

End = Literal["", "lower", "upper"]


def end_of(value: float, limits: tuple[float, float]) -> End:
    """Return the end of its range at which a number sits; "" inside, or where it has no choice."""
    low, high = limits
    margin = _AT_LIMIT * (high - low)
    if low == high:
        return ""
    if value >= high - margin:
        return "upper"
    return "lower" if value <= low + margin else ""


def spring_ends(
    values: Mapping[str, Any], ranges: Mapping[str, tuple[float, float]]
) -> dict[str, End]:
    """Return the free springs that sit at an end of their range, and at which.

    Args:
        values: Stiffness by spring [N m/rad]; other keys do no harm.
        ranges: Lowest and highest allowed value by spring [N m/rad].
    """
    known = {
        name: end_of(values[name], ranges[name]) for name in ranges if values.get(name) is not None
    }
    return {name: end for name, end in known.items() if end}


def spring_notes(values: Mapping[str, Any], ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    """Return what it means for the result that springs sit at an end of their range."""
    return [
        f"{measure_of(name).label} sits at its {end} limit of {ranges[name][end == 'upper']:.4g} "
        f"N m/rad: a {_WISH[end]} one would cost less"
        for name, end in spring_ends(values, ranges).items()
    ]


def solution_notes(solution: GaitSolution) -> list[str]:
    """Return what to beware of in a converged solution: forces that are not exact, odd walks."""
    notes = list(unusual(stride_of(solution.last_iterate)))
    if solution.second_engine > _EXACT:
        notes.append(
            f"numeric Pinocchio finds the equations of motion violated by up to "
            f"{solution.second_engine:.2g} N or N m between the nodes: forces and torques are no "
            "better than that; more intervals, or transcription: collocation, are"
        )
    return notes


def summary_rows(
    metrics: Mapping[str, Any], status: str, cost: float | None = None
) -> list[tuple[str, str]]:
    """Return label and value of every line of the summary.

    Args:
        metrics: Content of `metrics.json`.
        status: How the solve ended.
        cost: Value of the objective; left out without one.
    """
    steps = (f"{side} {metrics[f'step_length_{side}']:.3f} m" for side in SIDES)
    knees = (
        f"{side} {np.rad2deg(metrics[f'min_stance_knee_flexion_{side}']):.1f} deg" for side in SIDES
    )
    rows = [("status", status)]
    if cost is not None:
        rows.append(("cost", f"{cost:.5g}"))
    rows += [
        ("walking speed", f"{metrics['walking_speed']:.3f} m/s"),
        ("stride", f"{metrics['distance']:.3f} m in {metrics['stride_time']:.3f} s"),
        ("step length", ", ".join(steps)),
        ("least knee flexion in stance", ", ".join(knees)),
        ("feet land on", ", ".join(_landing(metrics, side) for side in SIDES)),
    ]
    for name in STIFFNESSES:
        if (value := metrics.get(name)) is not None:
            text = f"{value:.1f} N m/rad ({np.deg2rad(value):.2f} N m/deg)"
            rows.append((measure_of(name).label, text))
    cuffs = [
        _cuff(metrics, side) for side in SIDES if metrics.get(f"peak_shin_force_{side}") is not None
    ]
    if cuffs:
        rows.append(("cuffs press at most", ", ".join(cuffs)))
    told = {key for m in TABLES["summary"] for key in expanded(m)}
    for measure in measures_in("summary"):
        if measure.key not in told and measure.key in metrics:
            value = measure.text(metrics[measure.key])
            rows.append((measure.label, f"{value} {measure.shown_unit}".rstrip()))
    return rows


def _landing(metrics: Mapping[str, Any], side: str) -> str:
    """Return what of a foot lands first, where between heel and toe, and whether it stays there."""
    index, rearmost = metrics[f"strike_index_{side}"], metrics[f"rearmost_pressure_{side}"]
    part = "rearfoot" if index < 1 / 3 else "midfoot" if index < 2 / 3 else "forefoot"
    stays = ", walks on the toes" if (rearmost or 0.0) > 2 / 3 else ""
    return f"{side} {part} ({100 * index:.0f} % of heel to toe){stays}"


def _cuff(metrics: Mapping[str, Any], side: str) -> str:
    """Return the largest forces of a cuff and the pressure under it, and how far it gives way."""
    shin, calf = (metrics[f"peak_{part}_force_{side}"] for part in ("shin", "calf"))
    pressure = metrics[f"peak_cuff_pressure_{side}"] / 1000.0
    text = f"{side} shin {shin:.0f} N, calf {calf:.0f} N ({pressure:.1f} kPa)"
    if (slides := metrics.get(f"pistoning_{side}")) is None:
        return text
    into, beside = (metrics[f"{name}_{side}"] for name in ("cuff_depth", "hinge_difference"))
    return (
        f"{text}, {1000.0 * into:.1f} mm into the leg, sliding {1000.0 * slides:.1f} mm, ankle "
        f"{np.rad2deg(beside):.1f} deg against the hinge"
    )


def summary(rows: Sequence[tuple[str, str]], notes: Iterable[str] = (), width: int = 0) -> str:
    """Return labels and values as plain text, then what else to know, one line each."""
    width = max([width, *(len(label) for label, _ in rows)])
    lines = [f"{label:<{width}}  {value}" for label, value in rows]
    return "\n".join([*lines, *(f"note: {note}" for note in notes)])


def summary_renderable(
    rows: Sequence[tuple[str, str]], notes: Iterable[str] = (), width: int = 0
) -> RenderableType:
    """Return the same for a `rich` console, on which long texts stay in their column."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", no_wrap=True, min_width=width)
    table.add_column()
    for label, value in rows:
        table.add_row(label, Text(value))
    return Group(table, *(Text.assemble(("note: ", "yellow"), note) for note in notes))


_ANGLES: Final = frozenset(EVERY_JOINT.angles)
_UNITS: Final = {"duration": "s", "walking_speed": "m/s", "distance": "m"}

_MET: Final = 1e-6
"""Violation up to which a constraint counts as met, each in its own unit."""


def interesting(bound: ActiveBound) -> bool:
    """Return whether a bound is a choice that shapes the gait: joint range, duration, speed."""
    return bound.name in _ANGLES or bound.name in _UNITS or bound.name in STIFFNESSES


def bound_lines(solution: GaitSolution) -> list[str]:
    """Return one line per active bound of interest; stiffnesses have their own note.

    The bounds of a solve that did not converge hold nothing back yet.
    """
    if not solution.converged:
        return []
    return [
        bound_line(bound)
        for bound in solution.active
        if interesting(bound) and bound.name not in STIFFNESSES
    ]


def bound_line(bound: ActiveBound) -> str:
    """Return an active bound in words."""
    where = f" in {', '.join(bound.places)}" if bound.places else ""
    if bound.name in _ANGLES:
        amount = f"{bound.value:.3f} rad ({to_degrees(bound.value):.1f} deg)"
    else:
        amount = f"{bound.value:.4g} {_UNITS.get(bound.name, 'N m/rad')}"
    name = {"duration": "phase duration"}.get(bound.name, bound.name)
    if bound.name not in _ANGLES:
        name = name.replace("_", " ")
    return f"{name} at its {bound.side} bound {amount}{where}"


def detail_lines(solution: GaitSolution, metrics: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return label and text of proof, active bounds, stages and times."""
    worst, terms = solution.violations[0], solution.cost_terms
    errors = solution.reintegration
    again = f"{errors.worst_position:.1e} rad or m, {errors.worst_velocity:.1e} rad/s or m/s"
    stages = [f"{s.name} {s.iterations} in {s.seconds:.1f} s" for s in solution.stages]
    seconds = (f"{part} {metrics[f'seconds_{part}']:.1f}" for part in ("build", "solve", "verify"))
    rows = [
        ("cost terms", " + ".join(f"{_words(n)} {v:.4g}" for n, v in terms.items() if v)),
        ("clinical goals", ", ".join(f"{_words(n)} {v:.4g}" for n, v in metrics["goals"].items())),
        ("largest violation", f"{worst.amount:.1e} ({worst.name})"),
        ("re-integration error", again),
        ("discretisation", _discretisation_text(solution, metrics["measure_errors"])),
        ("second engine", f"equations of motion met within {solution.second_engine:.1e} N or N m"),
        ("balances", _balance_text(metrics["balance"])),
        (
            "iterations",
            f"{', '.join(stages) or 'none'}; {solution.last_motion.intervals} intervals at last",
        ),
        ("seconds", ", ".join(seconds)),
        ("dynamics, start", f"{solution.walker.backend}, {solution.start}"),
    ]
    return [*rows, *(("active bound", line) for line in bound_lines(solution))]


_DISCRETISED: Final = (
    "walking_speed",
    "step_length_*",
    "min_stance_knee_flexion_*",
    "peak_vertical_force_*_body_weights",
)
"""Families of measures whose estimated errors stand in the terminal; files have those of all."""


def _discretisation_text(solution: GaitSolution, errors: Mapping[str, float | None]) -> str:
    """Return what a finer mesh would change, measures as far as their digits show it."""
    if solution.cost_error is None:
        return "not estimated: the mesh is too coarse to tell"
    share = 100.0 * solution.cost_error / abs(solution.cost)
    changes = [f"the cost by about {share:+.2g} %"]
    for key in (key for family in _DISCRETISED for key in expanded(family)):
        measure, change = measure_of(key), errors.get(key)
        text = measure.text(change, sign=True)
        if change is not None and float(text):
            changes.append(f"{measure.label} by {text} {measure.shown_unit}")
    return f"halving all mesh intervals would change {', '.join(changes)}"


def _balance_text(found: Mapping[str, float]) -> str:
    energy = f"{found['energy']:.1e} J of {found['work_scale']:.3g} J"
    momentum = f"{found['impulse']:.1e} N s of {found['impulse_scale']:.3g} N s"
    text = f"work and energy within {energy}, forces and momentum within {momentum}"
    lost = found["ground_loss"]
    return f"{text}; the ground takes up {lost:.2g} J" if lost > 0.0 else text


def _words(name: str) -> str:
    return name.replace("_", " ")


def optimum_lines(optima: Sequence[LocalOptimum]) -> list[tuple[str, str]]:
    """Return label and text of every local optimum, best first, and how far they lie apart."""
    lines = []
    for found in optima:
        springs = ", ".join("-" if k is None else f"{k:.1f}" for k in found.stiffness)
        text = f"start {found.start}: cost {found.cost:.5g}, {found.walking_speed:.3f} m/s"
        text += f", K_D r l, K_P r l {springs} N m/rad" if springs else ""
        lines.append(("local optimum", text if found.converged else f"{text}, {found.status}"))
    costs = [found.cost for found in optima if found.converged]
    if len(costs) > 1:
        near = sum(cost <= costs[0] + 0.05 * abs(costs[0]) for cost in costs)
        spread = (costs[-1] - costs[0]) / abs(costs[0])
        text = f"{len(costs)} of {len(optima)} starts converged, {near} within 5 % of the best; "
        lines.append(("local optima", f"{text}the worst is {100 * spread:.1f} % above"))
    return lines


def source_lines(sources: Mapping[str, str]) -> list[str]:
    """Return where the bounds come from, in short: equal reasons are said once."""
    groups: dict[tuple[str, str], list[str]] = {}
    for name, text in sources.items():
        if name in _ANGLES:
            key = ("joint ranges", text.partition("] rad, ")[2] or text)
        elif name.startswith("duration"):
            key = ("phase durations", text)
        elif name in STIFFNESSES:
            key = ("stiffness", text.partition(": ")[0])
        else:
            key = (name.replace("_", " "), text)
        groups.setdefault(key, []).append(name.removeprefix("duration of "))
    kinds = [kind for kind, _ in groups]
    lines = []
    for (kind, reason), names in groups.items():
        several = kinds.count(kind) > 1
        lines.append(f"{kind} of {', '.join(names)}: {reason}" if several else f"{kind}: {reason}")
    return lines


def failure_text(solution: GaitSolution, folder: str) -> str:
    """Return one sentence about a solve that did not converge."""
    why = solution.shortfall
    parts = [] if why is None else [shortfall_text(why)]
    if why is None or not why.too_weak:
        parts.append(_violations_text(solution))
    detail = "; ".join(parts)
    return (
        f"{solution.config.problem} did not converge: {solution.status}; {detail}; "
        f"the last iterate is in {folder}, marked as not converged"
    )


def _violations_text(solution: GaitSolution) -> str:
    """Return in words which constraints are not met, and how far off an integrator is."""
    worst = [v for v in solution.violations if not v.amount <= _MET][:3]
    if worst:
        named = ", ".join(f"{v.name} by {v.amount:.2g}" for v in worst)
        detail = f"the worst violations are {named}"
    else:
        largest = np.max([v.amount for v in solution.violations])
        detail = f"all constraints are met within {largest:.1e}"
    errors = solution.reintegration
    if errors is not None:
        detail += (
            f", and an independent integrator misses the next node by "
            f"{errors.worst_position:.1e} (rad, m) and {errors.worst_velocity:.1e} (rad/s, m/s)"
        )
    return detail


def shortfall_text(shortfall: Shortfall) -> str:
    """Return in words why no motion was found."""
    if not shortfall.within_bounds:
        return "not even muscles of any strength were found to walk within the bounds"
    if not shortfall.missing:
        return "the muscles are strong enough, so another start may lead to a solution"
    lacking = [
        f"{_in_words(missing.generator)} {missing.torque:.1f} N m beyond its "
        f"{missing.strength:.1f} N m, at {missing.percent:.0f} % of the stride"
        for missing in shortfall.missing[:3]
    ]
    more = len(shortfall.missing) - len(lacking)
    others = f"; of {more} others a smaller share" if more else ""
    return f"the least help with which a walk was found is {', '.join(lacking)}{others}"


def _in_words(generator: str) -> str:
    """Return e.g. "right ankle extension" for "ankle_extension_r"."""
    stem, _, suffix = generator.rpartition("_")
    side = next((side for side in SIDES if SUFFIX[side] == suffix), "")
    return f"{side} {stem}".replace("_", " ") if side else generator.replace("_", " ")


def notes_together(notes: Sequence[str]) -> tuple[str, ...]:
    """Return what was filled in for a patient, lengths from body proportions in one sentence."""
    begin = "segment length "
    lengths = [note for note in notes if note.startswith(begin)]
    names = ", ".join(note.removeprefix(begin).partition(":")[0] for note in lengths)
    reason = lengths[0].partition(", ")[2] if lengths else ""
    together = (f"segment lengths {names}: {reason}",) if lengths else ()
    return (*together, *(note for note in notes if note not in lengths))


_KINDS: Final = {"dorsiflexion": "K_D", "plantarflexion": "K_P"}


def angle_words(angle: float) -> str:
    """Return an ankle angle [rad, + plantarflexion] in degrees with its direction."""
    degrees = f"{float(to_degrees(abs(angle))):.1f}"
    if degrees == "0.0":
        return "0 deg"
    return f"{degrees} deg {'plantarflexion' if angle > 0.0 else 'dorsiflexion'}"


def orthosis_rows(orthosis: OrthosisData) -> list[tuple[str, str]]:
    """Return label and text of what is worn on each leg and which springs there are."""
    rows = [
        (label, text)
        for label, words in (("orthosis", _joint), ("stops", _stops), ("springs", _springs))
        for text in _by_side(orthosis, words)
    ]
    if orthosis.springs is not None:
        named = [
            f"{k} " + ", ".join(f"{s.name} {s.stiffness:g}" for s in getattr(orthosis.springs, n))
            for n, k in _KINDS.items()
        ]
        rows.append(("real springs", f"{'; '.join(named)} N m/rad ({orthosis.springs.source})"))
    return rows


def _by_side(orthosis: OrthosisData, words: Callable[[OrthosisData, str], str]) -> list[str]:
    """Return what is to be said of the sides that wear it, equal ones together."""
    sides: dict[str, list[str]] = {}
    for side in orthosis.sides:
        sides.setdefault(words(orthosis, side), []).append(side)
    only = " only" if len(orthosis.sides) == 1 else ""
    return [f"{' and '.join(those)}{only}: {text}" for text, those in sides.items()]


def _joint(orthosis: OrthosisData, side: str) -> str:
    mass, play = orthosis.mass, float(to_degrees(orthosis.free_play[side]))
    return (
        f"{mass.shank[side]:g} kg on the shank, {mass.foot[side]:g} kg on the foot, neutral angle "
        f"{angle_words(orthosis.neutral_angle[side])}, play {play:.1f} deg around it, preload "
        f"{orthosis.preload_torque[side]:g} N m either way"
    )


def _stops(orthosis: OrthosisData, side: str) -> str:
    low, high = orthosis.dorsiflexion_stop[side], orthosis.plantarflexion_stop[side]
    stiffness = " and ".join(f"{getattr(orthosis.stop_stiffness, n)[side]:g}" for n in _KINDS)
    return f"{angle_words(low)} to {angle_words(high)}, as stiff as {stiffness} N m/rad"


def _springs(orthosis: OrthosisData, side: str) -> str:
    span = orthosis.stiffness_range
    pairs = ((k, getattr(span, name)[side]) for name, k in _KINDS.items())
    ranges = ", ".join(f"{k} {low:g} to {high:g}" for k, (low, high) in pairs)
    return f"{ranges} N m/rad ({span.source})"
