"""What a run stands on: model, sources, active bounds, proof, versions and config."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.values import changed_values, value_text
from pathwalker_cli.conventions import LEG_JOINTS, SUFFIX
from pathwalker_cli.report.content import Section, fact_table
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.results.metrics import RunMetrics
from pathwalker_cli.results.text import bound_line, interesting, notes_together, source_lines

_METHODS: Final = {
    "collocation": "direct collocation",
    "multiple-shooting": "direct multiple shooting",
}
_JOINT: Final = re.compile(rf"\b({'|'.join(LEG_JOINTS)})_([rl])\b")
_TWO_FEET: Final = re.compile(r"\b(right|left)_(toe|flat)_(right|left)_(heel|flat)\b")
_SIDE: Final = {suffix: side for side, suffix in SUFFIX.items()}
_HASH: Final = 12
"""Digits of a hash that tell files apart."""


def assumption_section(runs: Sequence[ReportRun]) -> Section:
    """Return what was assumed and what was reached, a column per run."""
    columns = [dict(_facts(run)) for run in runs]
    labels = dict.fromkeys(label for column in columns for label in column)
    rows = tuple((label, *(column.get(label, "-") for column in columns)) for label in labels)
    head = ("", *(run.label for run in runs))
    return Section("What was assumed, and what was reached", tables=(fact_table(rows, head),))


def _aim(config: StudyConfig) -> str:
    """Return in words what the gait is best at."""
    cost = config.cost
    if config.fits:
        return "nearest to a recording"
    power = cost.activation_power
    effort = "squared activation" if power == 2 else f"activation to the power {power}"
    aims = [f"least {effort} per distance"]
    if cost.walking_speed_weight:
        aims.append(f"speed (weight {cost.walking_speed_weight:g})")
    aims += [f"{n.replace('_', ' ')} (weight {cost.goals[n]:g})" for n in cost.wanted.names]
    return ", ".join(aims)


def _facts(run: ReportRun) -> Iterator[tuple[str, str]]:
    """Yield label and sentence."""
    metrics, config = run.run.metrics, run.run.config
    walker = run.evaluation.gait.walker
    quirks = ", with the quirks of the published model" if metrics.get("published_model") else ""
    yield (
        "Model",
        (
            f"flat rigid-body walker of {walker.total_mass:.1f} kg in all with 14 muscle torque "
            f"generators, two contact points per foot; dynamics back end "
            f"{_text(metrics, 'dynamics_backend')}{quirks}; assumed aim: {_aim(config)}"
        ),
    )
    notes = metrics.get("notes") or []
    yield (
        "Mass, strengths",
        ". ".join(
            [
                f"body mass {run.patient.body_mass:g} kg and strengths from the patient's file",
                *notes_together([*map(str, notes)]),
            ]
        ),
    )
    yield "Active bounds", "; ".join(_bounds(run.run.result)) or "none that shapes the gait"
    worst = _in_words(_text(metrics, "largest_violation_name"))
    yield (
        "Tolerances",
        (
            f"optimality {config.solver.tolerance:g}, constraints "
            f"{config.solver.constraint_tolerance:g}; reached: largest violation "
            f"{_short(metrics, 'largest_violation')} ({worst})"
        ),
    )
    yield (
        "Re-integration",
        (
            "an independent integrator misses the next node by at most "
            f"{_short(metrics, 'reintegration_position_error')} rad or m and "
            f"{_short(metrics, 'reintegration_velocity_error')} rad/s or m/s (asked for: "
            f"{config.mesh.position_tolerance:g}, {config.mesh.velocity_tolerance:g})"
        ),
    )
    yield (
        "Second engine",
        (
            "numeric Pinocchio meets the equations of motion within "
            f"{_short(metrics, 'second_engine_residual')} N or N m"
        ),
    )
    yield (
        "Mesh, iterations",
        (
            f"{_METHODS.get(config.transcription, config.transcription)}, "
            f"{_text(metrics, 'intervals')} intervals, {_text(metrics, 'iterations')} iterations; "
            f"start: {_text(metrics, 'start')}; cost {_short(metrics, 'cost', '.5g')}"
        ),
    )
    versions = metrics.get("versions") or {}
    yield "Versions", ", ".join(f"{name} {number}" for name, number in versions.items())
    hashes = metrics.get("input_hashes") or {}
    yield "Inputs", ", ".join(f"{name} {str(h)[:_HASH]}" for name, h in hashes.items())
    changed = changed_values(config)
    yield (
        "Config",
        "; ".join(f"{key} = {value_text(now)}" for key, (now, _) in changed.items())
        or "all defaults",
    )


def _bounds(result: RunMetrics) -> Iterator[str]:
    """Yield the active bounds that are choices, where they come from, and how many others."""
    chosen = [bound for bound in result.bounds if interesting(bound)]
    yield from (_in_words(bound_line(bound)) for bound in chosen)
    given = result.bound_sources or {}
    sources = {b.name: given[b.name] for b in chosen if b.name in given}
    yield from source_lines(sources)
    others = len(result.active_bounds or ()) - len(chosen)
    if others:
        yield f"{others} more of muscles, ground forces and foot heights at their natural limits"


def _in_words(text: str) -> str:
    """Return a text that says "right knee" for "knee_r" and names feet and joints without "_"."""
    text = _JOINT.sub(lambda found: f"{_SIDE[found[2]]} {found[1]}", text)
    return _TWO_FEET.sub(r"\1 \2 with \3 \4", text).replace("_", " ")


def _short(metrics: Mapping[str, Any], key: str, form: str = ".1e") -> str:
    """Return a number of the metrics, "unknown" if it is none."""
    value = metrics.get(key)
    return format(value, form) if isinstance(value, int | float) else "unknown"


def _text(metrics: Mapping[str, Any], key: str) -> str:
    value = metrics.get(key)
    return "unknown" if value is None else str(value)
