"""The page of results: problems, local optima, every number of the article, figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, Final

from pathwalker_cli.evaluation.evaluate import Change
from pathwalker_cli.evaluation.paper import NUMBERS, PaperClaim, PaperNumber
from pathwalker_cli.reproduce.comparison import Row, all_rows
from pathwalker_cli.reproduce.results import METHODS, ProblemResult, Results
from pathwalker_cli.reproduce.words import (
    degrees,
    deviation,
    label,
    ours_text,
    plain,
    printed,
    subject,
    table,
)
from pathwalker_cli.results.text import interesting

_HEAD: Final = (
    "Results of `pathwalker reproduce` beside those of Sreenivasa M, Millard M, Felis M, Mombaur "
    "K, Wolf SI (2017), Frontiers in Computational Neuroscience 11:23, "
    "[doi 10.3389/fncom.2017.00023](https://doi.org/10.3389/fncom.2017.00023)."
)
_WARNING: Final = (
    "PathWalker is research software. It is **not a medical device**, and nothing here is a basis "
    "for the treatment of a patient."
)
_READING: Final = (
    "*As printed*: ours, truncated or rounded, has the digits of the article, which truncates: a "
    "speed of 0.6098 m/s is printed as 0.60. The article's predictions have bounds that are not "
    "published, so a deviation of a prediction is no error of either. Every number under *ours* "
    "was computed from the runs and recordings named here; where none was, the cell says why."
)
_INPUTS: Final = (
    "The healthy child is an input of the model; *ours* is the patient's file that comes with "
    "PathWalker:"
)
_UNCHANGED: Final = 5e-3
"""Share of its value by which a quantity may move and still count as unchanged."""
_PLACES: Final = {
    "table 1": "Table 1: maximum isometric torques",
    "table 3": "Table 3: residuals of inverse dynamics",
    "table 4": "Table 4: step lengths and walking speeds",
    "section 3": "Section 3: all other numbers of the results",
    "section 4": "Section 4: numbers of the discussion",
}


def page_text(
    results: Results, versions: Mapping[str, str], date: str, figures: Sequence[tuple[str, str]]
) -> str:
    """Return the page as Markdown.

    Args:
        results: What was computed.
        versions: Versions of PathWalker and what it stands on.
        date: When.
        figures: File below the page's folder and caption of every figure.
    """
    lines = ["# The article and PathWalker", "", _HEAD, "", _WARNING, ""]
    lines += [*_state(results, versions, date), "", "## Problems", ""]
    lines += [*problem_lines(results), "", "## Local optima", "", *optima_lines(results)]
    lines += ["", "## The article's numbers", "", _READING]
    rows = all_rows(results)
    for place, title in _PLACES.items():
        own = [row for row in rows if row.number.place.partition(",")[0] == place]
        lines += ["", f"### {title}", ""]
        methods = [row for row in own if row.method] if place.startswith("table") else []
        lines += _by_method(methods) if methods else []
        plain_rows = [row for row in own if row not in methods]
        lines += ["", _INPUTS, ""] if methods and plain_rows else []
        lines += _plainly(plain_rows) if plain_rows else []
    lines += ["", "### Table 5: springs that are 5 % softer", "", *_table_5()]
    lines += ["", "### Changes that the article states", "", *_change_lines(results.changes)]
    pictures = [f"![{caption}]({file})\n\n*{caption}*\n" for file, caption in figures]
    lines += ["", "## Figures", "", *(pictures or ["None: no problem converged."])]
    return "\n".join(lines) + "\n"


def _state(results: Results, versions: Mapping[str, str], date: str) -> Iterator[str]:
    """Yield when and with what this was made, and what is missing."""
    yield f"Made on {date} with {', '.join(f'{n} {v}' for n, v in versions.items())}."
    if results.quick:
        yield (
            "\n**A quick check:** coarse meshes without refinement and one start, to see that "
            "everything runs. The numbers are for orientation only."
        )
    if results.failed:
        yield f"\n**Did not converge:** {', '.join(results.failed)}. Nothing of them is used below."


def _plainly(rows: Iterable[Row]) -> list[str]:
    """Return a table with one row per number, or two where two methods give it."""
    cells = []
    for row in rows:
        method = f" ({row.method} method)" if row.method else ""
        name = f"{subject(row.number)}: {label(row.number)}{method}"
        cells.append((name, printed(row.number), ours_text(row), deviation(row), _why(row)))
    return table(("quantity", "paper", "ours", "deviation", "why"), cells)


def _by_method(rows: Sequence[Row]) -> list[str]:
    """Return a table with the methods of inverse dynamics side by side."""
    grouped: dict[PaperNumber, dict[str, Row]] = {}
    for row in rows:
        grouped.setdefault(row.number, {})[row.method] = row
    head = ["quantity", "paper"]
    for method in METHODS:
        head += [f"ours, {method} method", "deviation"]
    cells = []
    for number, by_method in grouped.items():
        line = [f"{subject(number)}: {label(number)}", printed(number)]
        for method in METHODS:
            own = by_method.get(method)
            line += ["-", "-"] if own is None else [
                "*n. c.*" if isinstance(own.ours, str) else ours_text(own), deviation(own)
            ]  # fmt: skip
        cells.append((*line, _why(next(iter(by_method.values())))))
    missing = {row.ours for row in rows if isinstance(row.ours, str)}
    notes = [f"*n. c.*, {each}.\n" for each in sorted(missing)]
    return notes + table((*head, "why"), cells)


def _why(row: Row) -> str:
    """Return the reason for a difference; none is needed where there is none."""
    single = isinstance(row.ours, str) or (row.agrees and not row.number.upper)
    return "" if single and not row.method else row.why


def _table_5() -> Iterator[str]:
    """Yield table 5 as printed: nothing of it is computed here."""
    yield "Not computed: the perturbation analysis is no part of this command. Printed, in %:\n"
    own = [number for number in NUMBERS if number.place == "table 5"]
    springs = groupby(own, lambda number: number.quantity.partition("_after_-5%_")[2])
    by_spring = {spring: list(numbers) for spring, numbers in springs}
    first = next(iter(by_spring.values()))
    head = [each.quantity.partition("_after_")[0].replace("_", " ") for each in first]
    cells = [
        (spring.replace("_", " "), *(str(number) for number in numbers))
        for spring, numbers in by_spring.items()
    ]
    yield from table(("softer spring", *head), cells)


def _change_lines(changes: Sequence[Change]) -> Iterator[str]:
    """Yield what the article says that the orthosis changes, and what it changes here."""
    if not changes:
        yield "Not computed: mapd-barefoot and mapd-orthosis did not both converge."
        return
    cells = []
    for change in changes:
        if (paper := change.paper) is None:
            continue
        rises = paper.rises if isinstance(paper, PaperClaim) else paper.value > 0.0
        moved = abs(change.value) > _UNCHANGED * abs(change.barefoot)
        same = ("yes" if (change.value > 0.0) == rises else "no") if moved else "no, unchanged"
        ours = (plain(change.barefoot, ".3f"), plain(change.orthosis, ".3f"),
                plain(change.value, "+.3f"), plain(change.recorded, "+.3f"))  # fmt: skip
        name = f"{change.measure.section.lower()}: {change.measure.row} [{change.measure.unit}]"
        cells.append((name, "rises" if rises else "falls", *ours, same))
    yield "From MAPD-Barefoot to MAPD-Orthosis, SI units and radians; recorded: change of the mean."
    yield ""
    head = ("quantity", "paper", "barefoot", "orthosis", "change", "recorded", "same direction")
    yield from table(head, cells)


Metrics = Mapping[str, Any]


def _pair(form: str, *keys: str) -> Callable[[Metrics], str]:
    """Return what shows two metrics side by side."""
    return lambda metrics: ", ".join(plain(metrics.get(key), form) for key in keys)


def _sides(stem: str, form: str) -> Callable[[Metrics], str]:
    """Return what shows a metric of the left and the right side."""
    return _pair(form, f"{stem}_left", f"{stem}_right")


_SOLVE: Final[dict[str, Callable[[Metrics], str]]] = {
    "status": lambda m: str(m["status"]),
    "cost": _pair(".4f", "cost"),
    "iterations": _pair("d", "iterations"),
    "seconds to build, to solve": _pair(".1f", "seconds_build", "seconds_solve"),
    "mesh intervals": _pair("d", "intervals"),
    "largest violation": _pair(".1e", "largest_violation"),
    "re-integration error [rad or m]": _pair(".1e", "reintegration_position_error"),
    "re-integration error [rad/s or m/s]": _pair(".1e", "reintegration_velocity_error"),
}
_GAIT: Final[dict[str, Callable[[Metrics], str]]] = {
    "walking speed [m/s]": _pair(".3f", "walking_speed"),
    "step length left, right [m]": _sides("step_length", ".3f"),
    "least knee flexion of stance left, right [deg]": lambda m: ", ".join(
        degrees(m[f"min_stance_knee_flexion_{side}"]) for side in ("left", "right")
    ),
    "effort per distance [s/m]": _pair(".4f", "effort_per_distance"),
    "peak vertical force left, right [body weights]": _pair(
        ".2f", "peak_vertical_force_left_body_weights", "peak_vertical_force_right_body_weights"
    ),
    "K_D left, right [N m/rad]": _sides("dorsiflexion_stiffness", ".1f"),
    "K_P left, right [N m/rad]": _sides("plantarflexion_stiffness", ".1f"),
}
"""Rows of the table: what a solve says, and what its gait says if it converged."""


def _shaping_bounds(result: ProblemResult) -> list[str]:
    return [str(bound) for bound in result.run.result.bounds if interesting(bound)]


def problem_lines(results: Results) -> Iterator[str]:
    """Yield the table of all problems and the list of their active bounds."""
    problems = results.problems
    rows = [("this call", *("kept" if each.kept else "solved now" for each in problems.values()))]
    for name, show in _SOLVE.items():
        rows.append((name, *(show(each.run.metrics) for each in problems.values())))
    counts = (str(len(_shaping_bounds(p))) if p.converged else "-" for p in problems.values())
    rows.append(("active bounds that shape the gait", *counts))
    for name, show in _GAIT.items():
        shown = (show(each.run.metrics) if each.converged else "-" for each in problems.values())
        rows.append((name, *(text.replace("-, -", "-") for text in shown)))
    yield from table(("", *problems), rows)
    yield "\n*kept*: solved by an earlier call with the same config; its times are those of then."
    yield "\nActive bounds that shape the gait:\n"
    for name, each in problems.items():
        bounds = "; ".join(_shaping_bounds(each)) or "none"
        yield f"- {name}: {bounds if each.converged else 'did not converge'}"


def optima_lines(results: Results) -> Iterator[str]:
    """Yield where the starts of every problem ended, best first."""
    for name, each in results.problems.items():
        optima = each.run.metrics.get("local_optima") or []
        if not optima:
            yield f"- {name}: one start ({each.run.metrics['start']})"
    for each in results.problems.values():
        if each.run.metrics.get("local_optima"):
            yield from _optima(each)


def _optima(result: ProblemResult) -> Iterator[str]:
    optima = result.run.metrics["local_optima"]
    best = optima[0]["cost"]
    yield f"\n{result.run.config.problem}, {len(optima)} starts:\n"
    shares = [100.0 * (each["cost"] - best) / abs(best) if best and each["cost"] is not None
              else None for each in optima]  # fmt: skip
    rows = [
        (str(each["start"]), each["status"], plain(each["cost"], ".4f"),
         "-" if share is None else f"{share:+.1f} %", plain(each["walking_speed"], ".3f"),
         ", ".join(plain(k, ".1f") for k in each["stiffness"]) or "-",
         str(each["iterations"]), plain(each["seconds"], ".0f"), each["description"])
        for each, share in zip(optima, shares, strict=True)
    ]  # fmt: skip
    head = ("start", "status", "cost", "above the best", "speed [m/s]",
            "K_D right, left, K_P right, left [N m/rad]", "iterations", "seconds",
            "began with")  # fmt: skip
    yield from table(head, rows)
