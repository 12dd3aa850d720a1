"""What a run stands on: model, sources, active bounds, proof, versions and config."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.learnt import config_values
from pathwalker_cli.config.values import changed_values, value_text
from pathwalker_cli.conventions import LEG_JOINTS, SUFFIX
from pathwalker_cli.model.contact import Feet
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.report.content import Section, fact_table
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.results.metrics import RunMetrics
from pathwalker_cli.results.text import bound_line, interesting, notes_together, source_lines

_METHODS: Final = {
    "collocation": "direct collocation",
    "multiple-shooting": "direct multiple shooting",
}
_FEET: Final[dict[Feet, str]] = {
    "points": "a heel and a toe point", "rockers": "circles at heel and toe that roll",
    "sole": "one convex sole that rolls", "compliant": "one convex sole that gives way",
}  # fmt: skip
_JOINT: Final = re.compile(rf"\b({'|'.join(LEG_JOINTS)})_([rl])\b")
_TWO_FEET: Final = re.compile(r"\b(right|left)_(toe|flat)_(right|left)_(heel|flat)\b")
_SIDE: Final = {suffix: side for side, suffix in SUFFIX.items()}
_MANY: Final = 5
"""Values of one part of a config up to which each is told; config.resolved.yaml tells all."""
_PLACES: Final = 1
"""Phases up to which each is told; metrics.json tells all."""
_ANGLE: Final = re.compile(r"-?[\d.]+ rad \((-?[\d.]+ deg)\)")
_HASH: Final = 12
"""Digits of a hash that tell files apart."""


def assumption_section(runs: Sequence[ReportRun]) -> Section:
    """Return what was assumed and what was reached, a column per run."""
    columns = [_facts(run) for run in runs]
    rows = tuple((label, *(column[label] for column in columns)) for label in columns[0])
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
        aims.append(f"speed (weight {cost.walking_speed_weight:.3g})")
    aims += [f"{n.replace('_', ' ')} (weight {cost.goals[n]:.3g})" for n in cost.wanted.names]
    return ", ".join(aims)


def _facts(run: ReportRun) -> dict[str, str]:
    result, config = run.run.result, run.run.config
    mesh, solver = config.mesh, config.solver
    toes = ", toes on a joint" if config.model.toes else ""
    shell = "; orthosis: a body of its own" if config.shelled else ""
    quirks = ", with the quirks of the published model" if result.published_model else ""
    return {
        "Model": "flat rigid-body walker with 14 muscle torque generators; feet: "
        f"{_FEET[config.model.feet]}{toes}{shell}; dynamics back end "
        f"{_text(result.dynamics_backend)}{quirks}; assumed aim: {_aim(config)}",
        "Mass, strengths": ". ".join([
            f"body mass {run.patient.body_mass:g} kg and strengths from the patient's file",
            *notes_together(result.notes or []),
        ]),
        "Active bounds": "; ".join(_bounds(result)) or "none that shapes the gait",
        "Tolerances": f"optimality {solver.tolerance:g}, constraints "
        f"{solver.constraint_tolerance:g}; reached: largest violation "
        f"{_short(result.largest_violation)} ({in_words(_text(result.largest_violation_name))})",
        "Re-integration": "an independent integrator misses the next node by at most "
        f"{_short(result.reintegration_position_error)} rad or m and "
        f"{_short(result.reintegration_velocity_error)} rad/s or m/s (asked for: "
        f"{mesh.position_tolerance:g}, {mesh.velocity_tolerance:g})",
        "Second engine": "numeric Pinocchio meets the equations of motion within "
        f"{_short(result.second_engine_residual)} N or N m",
        "Mesh, iterations": f"{_METHODS.get(config.transcription, config.transcription)}, "
        f"{_text(result.intervals)} intervals, {_text(result.iterations)} iterations; "
        f"start: {_text(result.start)}; cost {_short(result.cost, '.5g')}",
        "Versions": ", ".join(f"{name} {number}" for name, number in result.versions.items()),
        "Inputs": ", ".join(f"{n} {str(h)[:_HASH]}" for n, h in result.input_hashes.items()),
        "Config": "; ".join(_changes(config)) or "all defaults",
    }  # fmt: skip


def _changes(config: StudyConfig) -> Iterator[str]:
    """Yield the values that are no defaults; many of one kind, and learnt ones, only by number."""
    changed = {key: now for key, (now, _) in changed_values(config).items()}
    if config.learnt is not None:
        learnt = config_values(config.learnt.values)
        learnt |= {f"numbers.{place}": value for place, value in learnt.pop("numbers").items()}
        own = {k: v for k, v in changed.items() if not k.startswith("learnt.") and k not in learnt}
        yield f"{len(config.learnt.numbers)} learnt numbers"
        changed = own
    kinds = Counter(key.rpartition(".")[0] for key in changed)
    for kind, count in kinds.items():
        if count > _MANY:
            yield f"{count} values of {kind}"
    for key, now in changed.items():
        if kinds[key.rpartition(".")[0]] <= _MANY:
            yield f"{key} = {value_text(now)}"


def _bounds(result: RunMetrics) -> Iterator[str]:
    """Yield the active bounds that are choices, where they come from, and how many others."""
    chosen = [bound for bound in result.bounds if interesting(bound)]
    lines = (bound_line(_short_places(bound)) for bound in chosen)
    yield from (in_words(_ANGLE.sub(r"\1", line)) for line in lines)
    given = result.bound_sources or {}
    sources = {b.name: given[b.name] for b in chosen if b.name in given}
    yield from source_lines(sources)
    others = len(result.active_bounds or ()) - len(chosen)
    if others:
        yield f"{others} more of muscles, ground forces and foot heights at their natural limits"


def _short_places(bound: ActiveBound) -> ActiveBound:
    """Return a bound that names the phases in which it acts if they are few."""
    count = len(bound.places)
    return replace(bound, places=(f"{count} phases",)) if count > _PLACES else bound


def in_words(text: str) -> str:
    """Return a text that says "right knee" for "knee_r" and names feet and joints without "_"."""
    text = _JOINT.sub(lambda found: f"{_SIDE[found[2]]} {found[1]}", text)
    return _TWO_FEET.sub(r"\1 \2 with \3 \4", text).replace("_", " ")


def _short(value: float | None, form: str = ".1e") -> str:
    return "unknown" if value is None else format(value, form)


def _text(value: object) -> str:
    return "unknown" if value is None else str(value)
