"""How every problem was solved, and where its starts ended, as tables of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from pathwalker_cli.conventions import COORDINATES, STIFFNESSES
from pathwalker_cli.reproduce.results import ProblemResult, Results
from pathwalker_cli.reproduce.words import degrees, plain, table

__all__ = ["optima_lines", "problem_lines", "shaping_bounds"]

Metrics = Mapping[str, Any]

_SHAPING: Final = frozenset({*COORDINATES[2:], *STIFFNESSES, "duration", "walking_speed",
                             "distance"})  # fmt: skip
"""Bounds that are choices which shape a gait: joint range, duration, speed, springs."""


def _pair(form: str, *keys: str) -> Callable[[Metrics], str]:
    """Return what shows two metrics side by side."""
    return lambda metrics: ", ".join(plain(metrics.get(key), form) for key in keys)


def _sides(stem: str, form: str) -> Callable[[Metrics], str]:
    """Return what shows a metric of the left and the right side."""
    return _pair(form, f"{stem}_left", f"{stem}_right")


def _knees(metrics: Metrics) -> str:
    """Return the crouch measure left and right [deg]."""
    return ", ".join(degrees(metrics[f"min_stance_knee_flexion_{s}"]) for s in ("left", "right"))


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
    "least knee flexion of stance left, right [deg]": _knees,
    "effort per distance [s/m]": _pair(".4f", "effort_per_distance"),
    "peak vertical force left, right [body weights]": _pair(
        ".2f", "peak_vertical_force_left_body_weights", "peak_vertical_force_right_body_weights"
    ),
    "K_D left, right [N m/rad]": _sides("dorsiflexion_stiffness", ".1f"),
    "K_P left, right [N m/rad]": _sides("plantarflexion_stiffness", ".1f"),
}
"""Rows of the table: what a solve says, and what its gait says if it converged."""


def shaping_bounds(result: ProblemResult) -> list[str]:
    """Return the active bounds that are choices which shape the gait."""
    return [str(bound) for bound in result.bounds if bound.name in _SHAPING]


def problem_lines(results: Results) -> Iterator[str]:
    """Yield the table of all problems and the list of their active bounds."""
    problems = results.problems
    rows = [("this call", *("kept" if each.kept else "solved now" for each in problems.values()))]
    for name, show in _SOLVE.items():
        rows.append((name, *(show(each.metrics) for each in problems.values())))
    counts = (str(len(shaping_bounds(p))) if p.converged else "-" for p in problems.values())
    rows.append(("active bounds that shape the gait", *counts))
    for name, show in _GAIT.items():
        shown = (show(each.metrics) if each.converged else "-" for each in problems.values())
        rows.append((name, *(text.replace("-, -", "-") for text in shown)))
    yield from table(("", *problems), rows)
    yield ""
    yield "*kept*: solved by an earlier call with the same config; its times are those of then."
    yield ""
    yield "Active bounds that shape the gait:"
    yield ""
    for name, each in problems.items():
        found = "; ".join(shaping_bounds(each)) or "none"
        yield f"- {name}: {found if each.converged else 'did not converge'}"


def optima_lines(results: Results) -> Iterator[str]:
    """Yield where the starts of every problem ended, best first."""
    for name, each in results.problems.items():
        optima = each.metrics.get("local_optima") or []
        if not optima:
            yield f"- {name}: one start ({each.metrics['start']})"
    for each in results.problems.values():
        if each.metrics.get("local_optima"):
            yield from _optima(each)


def _optima(result: ProblemResult) -> Iterator[str]:
    """Yield the table of the local optima of one problem."""
    optima = result.metrics["local_optima"]
    best = optima[0]["cost"]
    yield ""
    yield f"{result.problem}, {len(optima)} starts:"
    yield ""
    rows = [
        (
            str(found["start"]),
            found["status"],
            plain(found["cost"], ".4f"),
            _above(found["cost"], best),
            plain(found["walking_speed"], ".3f"),
            ", ".join(plain(k, ".1f") for k in found["stiffness"]) or "-",
            str(found["iterations"]),
            plain(found["seconds"], ".0f"),
            found["description"],
        )
        for found in optima
    ]
    head = ("start", "status", "cost", "above the best", "speed [m/s]",
            "K_D right, left, K_P right, left [N m/rad]", "iterations", "seconds",
            "began with")  # fmt: skip
    yield from table(head, rows)


def _above(cost: float | None, best: float | None) -> str:
    """Return by how much a cost lies above the best one."""
    if cost is None or not best:
        return "-"
    return f"{100.0 * (cost - best) / abs(best):+.1f} %"
