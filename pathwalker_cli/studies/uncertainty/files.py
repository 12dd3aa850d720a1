"""The files of draws: a row per draw, how every measure spreads, and all of it as plain values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.studies.measures import range_content
from pathwalker_cli.studies.uncertainty.advice import advice, measure_first
from pathwalker_cli.studies.uncertainty.result import QUANTILES, Uncertainty

FILES: Final = ("draws.csv", "uncertainty.csv", "correlations.csv", "uncertainty.json")


def write_tables(result: Uncertainty, folder: Path) -> None:
    """Write `draws.csv`, `uncertainty.csv`, `correlations.csv` and `uncertainty.json`."""
    _write_draws(result, folder / FILES[0])
    header = ["measure", "unit", "base", "quantile 0.05", "median", "quantile 0.95", "draws [1]",
              "share at lower limit [1]", "share at upper limit [1]", "strongest input",
              "rank correlation [1]"]  # fmt: skip
    rows = []
    for spread in result.spreads:
        numbers = [_number(value) for value in (spread.base, *spread.quantiles)]
        rows.append([spread.measure.key, spread.measure.unit, *numbers, len(result.converged),
                     spread.lower, spread.upper, spread.place, spread.strength])  # fmt: skip
    write_table(folder / FILES[1], header, rows)
    columns: list[list[Any]] = [["input", *(entry.place for entry in result.draws.inputs)]]
    columns += [[f"{s.measure.key} [1]", *map(_number, s.correlations)] for s in result.spreads]
    names, *lines = zip(*columns, strict=True)
    write_table(folder / FILES[2], names, lines)
    write_json(folder / FILES[3], uncertainty_content(result))


def uncertainty_content(result: Uncertainty) -> dict[str, Any]:
    """Return how everything spreads as plain values; SI units."""
    return {
        "problem": result.config.problem,
        "patient": result.patient,
        "tolerance": result.config.solver.tolerance,
        "intervals": result.intervals,
        "seconds": result.seconds,
        "draws": len(result.solved),
        "failed": [end.name for end in result.failed],
        "base": result.base,
        **range_content(result.ranges),
        **({"further": result.further} if result.further else {}),
        "spreads": {
            spread.measure.key: {
                "quantiles": dict(
                    zip(map(str, QUANTILES), map(_number, spread.quantiles), strict=True)
                ),
                "share_at_lower_limit": spread.lower,
                "share_at_upper_limit": spread.upper,
                "strongest_input": spread.place or None,
                "rank_correlation": spread.strength,
            }
            for spread in result.spreads
        },
        "advice": list(advice(result)),
        "measure_first": measure_first(result),
    }


def _write_draws(result: Uncertainty, path: Path) -> None:
    """Write one row per draw: what was drawn, where it ended, and how to solve it again."""
    header = ["draw", *(entry.heading for entry in result.draws.inputs), "status"]
    header += [measure.column for measure in result.measures]
    header += ["iterations", "seconds [s]", "variation"]
    rows = []
    for number, end in enumerate(result.solved):
        variation = result.config.variation.merged(result.draws.variation(number))
        text = json.dumps(variation.model_dump(mode="json"))
        values = [end.values.get(m.key) for m in result.measures]
        drawn = result.draws.values[number].tolist()
        rows.append([number, *drawn, end.status, *values, end.iterations, end.seconds, text])
    write_table(path, header, rows)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
