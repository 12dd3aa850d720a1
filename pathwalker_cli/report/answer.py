"""The answer in sentences that a parent follows, and what it hangs on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pathwalker_cli.config.values import differing_values
from pathwalker_cli.conventions import STIFFNESSES, worn_words
from pathwalker_cli.report.assumptions import in_words
from pathwalker_cli.report.changes import Outcome, base_of, short, sides_of, together
from pathwalker_cli.report.content import Section
from pathwalker_cli.report.folders import Study
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.report.springs import left_open, prescribed, recommended
from pathwalker_cli.report.summaries import SensitivitySummary, UncertaintySummary
from pathwalker_cli.results.text import interesting
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.sensitivity.result import SHOWN, label_of
from pathwalker_cli.studies.uncertainty.result import most
from pathwalker_cli.studies.verdict.words import spread_command, stop_sentence

_KINDS = {
    "dorsiflexion": "the spring against the shin leaning forward (K_D)",
    "plantarflexion": "the spring against the foot pointing down (K_P)",
}
_BEYOND = "Nobody has walked with exactly these springs: watch the child walk before deciding."
_LIMITS = {"duration": "shortest or longest phase", "lumbar": "trunk"}
_NUMBERS = 3
"""Numbers of the child that are named because the answer follows them most."""


def answer(
    runs: Sequence[ReportRun], found: Sequence[Outcome], studies: Sequence[Study] = ()
) -> tuple[str, ...]:
    """Return the answer in plain sentences: how the child walks, which springs, how sure."""
    base = base_of(runs)
    sentences = [
        _changed(run, i, base, found) if base is not None else _walks(run, i, found)
        for i, run in enumerate(runs)
        if i != base
    ]
    worn = [run for run in runs if run.worn]
    for run in worn:
        sentences += [_springs(run, len(worn) > 1), *_spread(run, studies)]
    if not worn:
        sentences.append("No orthosis is worn, so nothing is said about springs.")
    end = _BEYOND if worn else "Compare it with the child before relying on it."
    return (*sentences, f"All of this was calculated, not measured. {end}")


def _walks(run: ReportRun, which: int, found: Sequence[Outcome]) -> str:
    """Return how one run walks."""
    numbers = {each.measure.key: each for each in found}
    speed = numbers["walking_speed"]
    knees = _pair(sides_of(found, "min_stance_knee_flexion_*"), which)
    steps = _pair(sides_of(found, "step_length_*"), which)
    verb = "is made to walk" if speed.set_by_bound[which] else "would walk"
    return (
        f"{_wearing(run)}, the child {verb} at {short(speed.measure, speed.values[which])} m/s in "
        f"steps of {steps} m, its knees never straighter than {knees} degrees (right and left)."
    )


def _changed(run: ReportRun, which: int, base: int, found: Sequence[Outcome]) -> str:
    """Return what is different from barefoot."""
    (speed,) = sides_of(found, "walking_speed")
    (effort,) = sides_of(found, "effort_per_distance")
    both = [f"{short(speed.measure, speed.values[i])}" for i in (which, base)]
    if all(speed.set_by_bound[i] for i in (which, base)):
        walks = f"is made to walk at the same {both[0]} m/s"
    else:
        words = {"better": "walk faster", "worse": "walk slower", "same": "walk about as fast"}
        than = f"{both[0]} instead of {both[1]} m/s"
        walks = f"would {words[speed.judged(which, base)]} ({than})"
    steps = _both(found, "step_length_*", which, base,
                  {"better": "with longer steps", "worse": "with shorter steps",
                   "same": "with steps about as long"})  # fmt: skip
    crouch = _both(found, "min_stance_knee_flexion_*", which, base,
                   {"better": "less crouched", "worse": "more crouched",
                    "same": "about as crouched"})  # fmt: skip
    share = 100.0 * (effort.values[which] / effort.values[base] - 1.0)
    less = {"better": f"{-share:.0f} % less effort", "worse": f"{share:.0f} % more effort",
            "same": "about the same effort"}[effort.judged(which, base)]  # fmt: skip
    return f"{_wearing(run)}, the child {walks}, {steps}, {crouch} and with {less} than barefoot."


def _both(
    found: Sequence[Outcome], family: str, which: int, base: int, words: dict[str, str]
) -> str:
    """Return in words how both sides change."""
    sides = sides_of(found, family)
    judged = together(sides, which, base)
    if judged is not None:
        return words[judged]
    return " and ".join(f"{words[s.judged(which, base)]} {s.measure.side}" for s in sides)


def _pair(sides: Sequence[Outcome], which: int) -> str:
    return " and ".join(short(each.measure, each.values[which]) for each in sides)


def _wearing(run: ReportRun) -> str:
    """Return what is worn, with the name of the run where it is more than its condition."""
    worn = worn_words(run.braced).capitalize()
    return worn if run.label == run.run.config.condition else f"{worn} ({run.label})"


def _springs(run: ReportRun, several: bool) -> str:
    named = f" of {run.label}" if several else ""
    if all(prescribed(run, name) for name in run.springs):
        return f"The springs{named} were given, not searched for: {_values(run, run.springs)}."
    if run.verdict is None:
        found = _values(run, run.springs)
        return f"How sure the springs{named} are was not examined; least effort took {found}."
    free = [name for name in run.springs if not prescribed(run, name)]
    undecided = [name for name in free if left_open(run, name)]
    if len(undecided) == len(free):
        return (
            f"Which springs{named} are fitted makes little difference to this calculation: take "
            "any of the drawer, and choose by fitting."
        )
    decided = [name for name in free if name not in undecided]
    text = f"Springs to fit{named}: {_values(run, decided)}"
    if undecided:
        kinds = dict.fromkeys(_kind(name) for name in undecided)
        text += f"; for {' and '.join(kinds)}, any of the drawer: choose by fitting"
    return f"{text}."


def _spread(run: ReportRun, studies: Sequence[Study]) -> Iterator[str]:
    """Yield how far springs spread over other sets of learnt numbers, and what to measure first."""
    learnt = run.run.config.learnt
    free = [name for name in run.springs if not prescribed(run, name)]
    if learnt is None or not free:
        return
    drawn = [
        study.summary
        for study in studies
        if isinstance(study.summary, UncertaintySummary)
        and study.summary.advice
        and study.stands_on(run.run.metrics)
    ]
    if not drawn:
        yield (
            "Other numbers explain the child's strides about as well and may want other springs; "
            f"how far they spread was not examined: {spread_command(run.run.folder)} tells."
        )
    for summary in drawn:
        spans = (
            f"{measure_of(name).label} {' to '.join(f'{end:.0f}' for end in summary.span(name))}"
            for name in free
        )
        solved = summary.draws - len(summary.failed)
        yield (
            f"Over {solved} sets of numbers that explain the child's strides about as well, "
            f"{most(solved)} give {', '.join(spans)} N m/rad."
        )
        first = summary.measure_first
        if first is not None:
            may = "may" if first.chance else "would"
            yield f"The measurement that {may} narrow K_D most: {label_of(first.place)}."


def _kind(name: str) -> str:
    return _KINDS[name.partition("_")[0]]


def _values(run: ReportRun, names: Sequence[str]) -> str:
    """Return springs with their stiffness, sides that agree together."""
    taken = recommended(run)
    parts: dict[str, list[str]] = {}
    for name in names:
        parts.setdefault(f"{_kind(name)} {taken[name]:.1f} N m/rad", []).append(
            name.rpartition("_")[2]
        )
    return ", ".join(f"{words} {' and '.join(sides)}" for words, sides in parts.items())


def hinge_section(runs: Sequence[ReportRun], studies: Sequence[Study]) -> Section:
    """Return what the answer hangs on, most important first."""
    points = [point for run in runs for point in _hinges(run)]
    points += _numbers(studies)
    if len(runs) > 1:
        points += _differences(runs)
    return Section("What the answer hangs on", points=tuple(dict.fromkeys(points)))


def _hinges(run: ReportRun) -> Iterator[str]:
    config, named = run.run.config, f"{run.label}: "
    for note in run.evaluation.unusual:
        yield f"{named}{note}"
    if config.learnt is not None:
        yield (
            "How tight and strong the child is, and what it avoids, are "
            f"{len(config.learnt.numbers)} numbers learnt from recorded strides; other sets "
            "explain these as well"
        )
    else:
        yield (
            "Muscle strengths, which are known to about a third, and the assumption that the child "
            "walks with the least effort its bounds allow"
        )
    held = [b.name for b in run.run.result.bounds if interesting(b) and b.name not in STIFFNESSES]
    if held:
        names = ", ".join(dict.fromkeys(in_words(_LIMITS.get(name, name)) for name in held))
        yield f"{named}limits that were set, not predicted, hold the walk: {names}"
    verdict = run.verdict
    if verdict is None:
        return
    if sentence := stop_sentence(verdict):
        yield f"{named}{sentence}"
    if verdict.starts < 2:
        yield f"{named}one local optimum; others were not searched for (starts: 8 does)"


def _numbers(studies: Sequence[Study]) -> Iterator[str]:
    """Yield which numbers of the child matter most, as far as studies tell."""
    for study in studies:
        match study.summary:
            case SensitivitySummary() as summary:
                strengths = {
                    place: abs(values.get("cost") or 0.0)
                    for place, values in summary.elasticities.items()
                    if place not in STIFFNESSES and abs(values.get("cost") or 0.0) >= SHOWN
                }
                most = sorted(strengths, key=strengths.__getitem__, reverse=True)[:_NUMBERS]
                names = ", ".join(
                    f"{label_of(place)} ({strengths[place]:.2g} % of the cost per %)"
                    for place in most
                )
                yield f"The numbers of the child that it follows most: {names}"
            case UncertaintySummary() as summary:
                yield from summary.advice


def _differences(runs: Sequence[ReportRun]) -> Iterator[str]:
    """Yield in what runs of one condition differ."""
    worn = [run for run in runs if run.worn]
    if len(worn) < 2:
        return
    for key, values in differing_values([run.run.config for run in worn]).items():
        pairs = ", ".join(f"{v} ({r.label})" for v, r in zip(values, worn, strict=True))
        yield f"The runs differ in {key}: {pairs}"
