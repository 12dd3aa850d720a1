"""Write `run-folder.md`: every file of a run folder, every column and every key of `metrics.json`.

Columns come from the tables that are written, keys of the gait from the registry of measures.

python docs/generate_run_folder.py
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli import build_walker, load_patient
from pathwalker_cli.conventions import CONTACT_FORCES, COORDINATES, GENERATORS, SIDES
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.results.run_folder import ENTRIES
from pathwalker_cli.results.tables import controls_table, forces_table, states_table, torques_table
from pathwalker_cli.stride import measures
from pathwalker_cli.stride.figures import FIGURES
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.series import GaitSeries

PAGE: Final = Path(__file__).with_name("run-folder.md")

_HEAD: Final = """\
# Run folder

<!-- Written by docs/generate_run_folder.py from the code that writes run folders: change that, and the
meanings in the script, not this. -->

What `pathwalker solve` writes, file by file, column by column, key by key. The folder is written in one
stroke: it is complete, or as it was before. SI units and radians throughout; names, orders and signs are those
of the [conventions](conventions.md).

"""

FILES: Final = {
    "metrics.json": "all numbers of the run, [see below](#metricsjson)",
    "states.csv": "motion and activations over time",
    "controls.csv": "excitations and activation rates over time",
    "forces.csv": "ground reaction forces over time",
    "torques.csv": "torques of muscles and orthoses over time; with `model.tissue: true` those of passive tissue too",
    "figures": f"{', '.join(f'`{name}`' for name in FIGURES)}; PNG and SVG. `orthosis_curves` with orthoses, `toe_joints` with `model.toes`, `cuffs` with `model.orthosis: body` only",
    "config.resolved.yaml": "the config of the run with every default and override written out; can be solved again",
    "patient.yaml": "the patient as read, before any variation of the config, the orthosis in its place; whatever "
    "stands on the run takes this one, and with it the folder is enough to [verify and repeat](verification.md) the run",
    "recordings": "the recording that a run began with or followed; only then",
    "log.txt": "input hashes, every stage and iteration, the verdict on the springs",
    "motion.npz": "the exact motion on its mesh, [see below](#motionnpz); what `--warm-start` reads",
    "multipliers.npz": "multipliers of the bounds on the `unknowns` and of the `rows`, scaled as the solver saw them; "
    "studies of neighbouring problems begin with them. Only of converged solves by collocation",
    "NOT_CONVERGED.txt": "only if the solve did not converge: the reason and the largest violations. The other files "
    "then show the last iterate, which is no solution ([when a run fails](failures.md))",
}

_TABLES: Final = {
    "states.csv": states_table,
    "controls.csv": controls_table,
    "forces.csv": forces_table,
    "torques.csv": torques_table,
}

_COLUMNS: Final = """\
## Columns of the tables

All tables have one row at time 0 and one at each collocation point, the same in each; the last point of a phase
belongs to the phase that ends. A header names each column with its unit: `knee_r [rad]`. Numbers have nine
significant digits. `states.csv` also has `phase`, the second column. A cell of the centre of pressure is empty
where the foot bears less than 5 % of body weight. `<generator>` stands for the names and the order in
[muscle torque generators](conventions.md#muscle-torque-generators).

| file | columns | unit |
| --- | --- | --- |
"""

_MOTION: Final = """\
## motion.npz

NumPy arrays.

| array | content |
| --- | --- |
| `phases` | names of the phases |
| `durations` | of the phases [s] |
| `parameters` | the numbers that were free to choose, in the order of `unknowns` in `metrics.json`: the four stiffnesses [N m/rad], then what the config frees; none barefoot |
| `<phase>.mesh` | nodes, from 0 to 1 |
| `<phase>.states` | coordinates and velocities at the nodes |
| `<phase>.smooth` | activations at the nodes |
| `<phase>.controls` | activation rates at the nodes [1/s] |
| `<phase>.integrals` | running costs at the nodes |
| `<phase>.inner_states` | states at the collocation points |
| `<phase>.algebraic` | accelerations, contact forces of the phase, reserves, at the collocation points |

"""

_METRICS: Final = """\
## metrics.json

SI units and radians. What does not exist or is not a number is `null`. `*` stands for `right` and `left`.

"""

OUTCOME: Final = {
    "run_format": "number of the layout of the folder",
    "problem": "what was solved",
    "patient": "id of the patient",
    "condition": "`barefoot` or `orthosis`",
    "status": "`converged`, or the reason why not in words",
    "smoke": "whether it was a quick check on a coarse mesh",
    "cost": "value of the objective",
    "cost_terms": "its terms by name; they add up to it",
    "goals": "value of every [clinical goal](own-cost.md), without weights, whether it was weighed or not",
}

PROOF: Final = {
    "largest_violation": "of all rows and bounds, in its own unit",
    "largest_violation_name": "which that is",
    "violations": "the largest ones, name and amount",
    "cost_error": "estimated change of the cost if all mesh intervals were halved; null where the mesh is too coarse to tell",
    "measure_errors": "the same of every measure that is one number, to first order, free numbers held [SI units]; empty where the cost's is null",
    "reintegration_position_error": "largest error of an independent integrator at the next node [rad, m]",
    "reintegration_velocity_error": "the same for velocities [rad/s, m/s]",
    "second_engine_residual": "largest violation of the equation of motion in numeric Pinocchio [N, N m]",
    "balance": "work of muscles and orthoses against mechanical energy [J], impulse of gravity and ground against "
    "linear [N s] and angular [N m s] momentum: largest differences since the beginning of the stride, and what they "
    "are to be compared with ([theory](theory.md#44-balances-of-work-and-momentum))",
    "shortfall": "of a run that found no motion: whether muscles of any strength walk within the bounds, and the "
    "torques [N m] that the muscles lack, with strength and percent of the stride; otherwise null",
    "active_bounds": "names of the bounds that hold the solution back, with value and phases",
    "active": "the same bounds typed: `name`, `side` (`lower` or `upper`), `value`, `places` (phases)",
    "stiffness_ranges": "by stiffness, allowed range [N m/rad]",
    "unknowns": "every number that was free to choose, in the order of `parameters` in `motion.npz`: name, place in the "
    "patient's file, value, unit and range [SI]",
    "bound_sources": "by quantity, its bounds and where they come from",
    "notes": "what was filled in or overridden in the patient's file",
    "verdict": "how sure the springs are, see [how sure is a spring](sensitivity.md): `springs` (region [N m/rad], limit, "
    "gradient and curvature of the cost relative to its size), `stops` (how far and how long they are exceeded, largest torque "
    "[N m], share of the impulse carried, stiffness, and `stiffer`: what a tenth more of it changes, to first order, SI units, the cost "
    "as a share), `stiffer_stops` (the same with twice the stiffness, solved again), `snapped` to real springs, `optima`; null "
    "where there is nothing to judge",
    "local_optima": "where all starts ended, best first; empty for a single start",
}

ORIGIN: Final = {
    "intervals": "mesh intervals of the last stage",
    "iterations": "over all stages",
    "stages": "by stage: name, status, intervals, unknowns, iterations, seconds",
    "seconds_build": "wall time of building the problem [s]",
    "seconds_solve": "wall time of solving it [s]",
    "seconds_verify": "wall time of the checks [s]",
    "start": "where the search began",
    "warm_start": "folder of the earlier run, or `null`",
    "dynamics_backend": "`pinocchio.casadi`, `compiled` or `direct`",
    "kernels": "vectors that the compiled kernels used: `x86-64-v4`, `x86-64-v3`, `generic`, or `none` compiled",
    "published_model": "whether the published model's misplaced right forearm was kept",
    "date": "day on which the run was made",
    "versions": "PathWalker, Python and numerical libraries",
    "input_hashes": "SHA-256 of resolved config, patient file, the run's own `patient.yaml` and earlier motion",
    "metrics_hash": "SHA-256 of all other metrics, for `verify`",
    "motion_hash": "SHA-256 of `motion.npz`",
    "multipliers_hash": "SHA-256 of `multipliers.npz`, if it was written",
}


def page() -> str:
    """Return the whole page."""
    assert FILES.keys() == ENTRIES, FILES.keys() ^ ENTRIES
    lines = ["| file | content |", "| --- | --- |"]
    lines += [f"| `{name}{'/' * (name == 'figures')}` | {text} |" for name, text in FILES.items()]
    columns = [row for name in _TABLES for row in _columns(name)]
    groups = {
        "Outcome": OUTCOME,
        "Gait": gait_keys(),
        "Proof, and what held it back": PROOF,
        "Mesh, times and origin": ORIGIN,
    }
    tables = [f"### {name}\n\n{_key_table(keys)}\n" for name, keys in groups.items()]
    parts = [
        "\n".join([*lines, "", ""]),
        _COLUMNS,
        "\n".join([*columns, "", ""]),
        _MOTION,
        _METRICS,
    ]
    return _HEAD + "".join(parts) + "\n".join(tables)


def gait_keys() -> dict[str, str]:
    """Return the keys that describe the gait, a star for the side, and what they mean."""
    return {m.family: _meaning(m) for m in measures.REGISTRY if m.kept and m.value is not None}


def expanded(key: str) -> tuple[str, ...]:
    """Return the keys that stand behind one with a `*`."""
    return tuple(key.replace("*", side) for side in SIDES) if "*" in key else (key,)


def _meaning(measure: Measure) -> str:
    """Return what a measure is, with its unit behind its first words."""
    if measure.unit in ("1", "body weights"):
        return measure.meaning
    first, mark, more = re.fullmatch(r"([^;:]*)([;:]?)(.*)", measure.meaning).groups()  # type: ignore[union-attr]
    return f"{first} [{measure.unit}]{mark}{more}"


def _key_table(keys: dict[str, str]) -> str:
    rows = [f"| `{key}` | {text.replace('|', '&#124;')} |" for key, text in keys.items()]
    return "\n".join(["| key | meaning |", "| --- | --- |", *rows])


def _columns(name: str) -> Iterator[str]:
    """Yield the rows that tell the columns of a table; neighbours of equal unit share one."""
    table = _TABLES[name](_standing())
    yield f"| `{name}` | `time` | s |"
    pairs = zip(table.names, table.units, strict=True)
    for (_, unit), group in groupby(pairs, key=lambda pair: (_family(pair[0]), pair[1])):
        yield f"| | {_listed([column for column, _ in group])} | {unit} |"


def _listed(columns: list[str]) -> str:
    """Return columns by name; those that every muscle torque generator has by their pattern."""
    suffix = columns[0].removeprefix(GENERATORS[0])
    if columns == [f"{generator}{suffix}" for generator in GENERATORS]:
        return f"`<generator>{suffix}`, one for each of the {len(GENERATORS)}"
    return ", ".join(f"`{column}`" for column in columns)


def _family(column: str) -> str:
    """Return what columns that belong together have in common."""
    for base in (*COORDINATES, *GENERATORS):
        if column.startswith(f"{base}_") and column.removeprefix(base) in _SUFFIXES:
            return column.removeprefix(base)
    return column.split("_")[0] if column.startswith(("foot", "centre", "orthosis")) else ""


_SUFFIXES: Final = (
    "_velocity", "_activation", "_excitation", "_activation_rate", "_torque", "_net_torque",
)  # fmt: skip


def _standing() -> GaitSeries:
    """Return one instant of nothing, which is all that headers need."""
    walker = build_walker(load_patient("sreenivasa2017-patient"), condition="orthosis")
    sizes = {"q": len(COORDINATES), "v": len(COORDINATES), "vdot": len(COORDINATES),
             "activation": len(GENERATORS), "activation_rate": len(GENERATORS),
             "force": len(CONTACT_FORCES), "reserve": len(COORDINATES),
             "element_force": sum(len(e.coordinates) for e in walker.elements)}  # fmt: skip
    zeros: dict[str, Any] = {name: np.zeros((1, size)) for name, size in sizes.items()}
    return GaitSeries(walker, None, np.zeros(1), (PHASE_NAMES[0],), **zeros)  # type: ignore[arg-type]


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
