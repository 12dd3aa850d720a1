"""What one iteration costs, where it goes, how it grows with the mesh, and what limits it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from context import Context
from measure import Cost, PartFailedError, Sample, fresh, sample_of
from report import Cell, Report, Table

ABOUT = "One iteration"
PROBLEMS = ("mapd-barefoot", "mapd-orthosis")
VARIANTS = {
    "shipped": "as shipped",
    "mumps": "MUMPS instead of the compiled factors",
    "casadi": "CasADi's virtual machine instead of tapes",
}
SLOW = 128
"""Intervals above which what is only there for comparison is measured once."""

FUNCTIONS = ("nlp", "jac_g", "hess_lag")
"""Functions that run all blocks; the gradient of the objective is one block."""

MOVED = 24
"""Bytes that an instruction reads and writes."""

Key = tuple[str, int, str]


@dataclass(frozen=True)
class Sizes:
    """How much is measured.

    Args:
        meshes: Intervals.
        iterations: Iterations on the first mesh.
        tracking: Iterations of the stage before.
    """

    meshes: tuple[int, ...] = (32, 64, 128, 256, 512)
    iterations: int = 40
    tracking: int = 15


TOY = Sizes((16, 32), 6, 4)


def run(context: Context) -> Report:
    """Measure iterations of the first mesh by IPOPT's own clock."""
    report, sizes = Report(), TOY if context.quick else Sizes()
    table = report.table(
        "CPU seconds per iteration, by IPOPT's own clock",
        ("problem", "intervals", "variant", "seconds", "functions", "factorisation", "back-solves",
         "rest", "factorisations", "iterations", "analysis, once", "peak [MB]"),
        f"First iterations of the first mesh, after {sizes.tracking} iterations of tracking; "
        "factorisations are counted per iteration. Analysis: CPU seconds to find the order of "
        "elimination, not part of an iteration.",
    )  # fmt: skip
    found: dict[Key, tuple[dict[str, Any], Cost]] = {}
    for problem in PROBLEMS:
        for intervals in sizes.meshes:
            for variant in VARIANTS:
                if variant == "shipped" or _compared(context, problem, intervals):
                    key = (problem, intervals, variant)
                    _add(context, sizes, table, found, key)
    _systems(report, found, limits := _limits(report, context))
    _functions(report, found, context.intervals, limits)
    _growth(report, found, (min(context.intervals, sizes.meshes[-1]), sizes.meshes[-1]))
    shipped = {key: value for key, value in found.items() if key[2] == "shipped"}
    report.peaks = {f"{key[0]}, {key[1]} intervals": cost.peak
                    for key, (_, cost) in shipped.items()}  # fmt: skip
    once = [sample_of(shipped[key][0]["parts"], "whole").median for key in shipped
            if key[1] == context.intervals]  # fmt: skip
    if once:
        report.reached["iteration"] = max(once)
    return report


def _compared(context: Context, problem: str, intervals: int) -> bool:
    """Return whether variants are measured too: one problem on all meshes, the other on one."""
    first, middle = problem == PROBLEMS[0], intervals == context.intervals
    return (first and middle) if context.quick else (first or middle)


def _add(
    context: Context,
    sizes: Sizes,
    table: Table,
    found: dict[Key, tuple[dict[str, Any], Cost]],
    key: Key,
) -> None:
    """Measure one variant and add its row."""
    problem, intervals, variant = key
    context.tell(f"{problem}, {intervals} intervals, {VARIANTS[variant]}")

    def cells() -> list[Cell]:
        once = variant != "shipped" and intervals > SLOW
        found[key] = fresh(
            "iterating:steps",
            context.cache,
            problem=problem,
            intervals=intervals,
            variant=variant,
            iterations=sizes.iterations,
            tracking=sizes.tracking,
            repetitions=1 if once else context.repetitions,
        )
        parts, cost = found[key][0]["parts"], found[key][1]
        times = [sample_of(parts, "whole")]
        times += [Sample((sample_of(parts, f"in_{name}").median,))
                  for name in ("functions", "factorisation", "back_solves", "rest")]  # fmt: skip
        counts = [parts[0].get("factorisations"), int(parts[0]["iterations"])]
        return [*times, *counts, sample_of(parts, "analysis").median, cost.peak]

    table.add([problem, intervals, VARIANTS[variant]], cells)


def _limits(report: Report, context: Context) -> dict[str, float]:
    """Measure what the machine can do at best."""
    context.tell("limits of the machine")
    table = report.table("Limits of this machine on one thread", ("what", "at best", "unit"))
    try:
        limits, _ = fresh("machine:limits")
    except PartFailedError as failure:
        table.rows.append([f"failed: {failure}"])
        return {}
    for key, what, unit in (
        ("dgemm_gflops", "product of matrices of order 512", "GFlop/s"),
        ("copy_gbs", "copy of 64 MB, read and written", "GB/s"),
        ("cached_copy_gbs", "copy of 128 KB, read and written", "GB/s"),
    ):
        table.rows.append([what, limits[key], unit])
    return limits


def _systems(
    report: Report, found: dict[Key, tuple[dict[str, Any], Cost]], limits: dict[str, float]
) -> None:
    """Show sizes, and what the factorisation reaches of what the machine can do."""
    table = report.table(
        "Newton systems and their factors",
        ("problem", "intervals", "unknowns", "rows", "nonzeros of Jacobian", "of Hessian",
         "MFlop per factorisation", "delayed columns", "GFlop/s reached", "of matrix product [%]"),
        "Unknowns without the fixed ones. Delayed columns found no pivot in their own group, in "
        "the last factorisation.",
    )  # fmt: skip
    for (problem, intervals, variant), (result, _) in found.items():
        if variant != "shipped":
            continue
        parts = result["parts"]
        first = parts[0]
        rows = first["equalities"] + first["inequalities"]
        nonzeros = first["equality_nonzeros"] + first["inequality_nonzeros"]
        row: list[Cell] = [problem, intervals, *map(int, (first["unknowns"], rows, nonzeros))]
        row.append(int(first["hessian_nonzeros"]))
        if "operations" in first:
            seconds = sample_of(parts, "in_factorisation").median
            reached = first["flops"] / seconds / 1e9 if seconds else None
            share = 100 * reached / limits["dgemm_gflops"] if limits and reached else None
            row += [first["operations"] / 1e6, int(first["delayed"]), reached, share]
        table.rows.append(row)


def _functions(
    report: Report,
    found: dict[Key, tuple[dict[str, Any], Cost]],
    intervals: int,
    limits: dict[str, float],
) -> None:
    """Show what the functions of the program cost, by tapes and by CasADi."""
    table = report.table(
        f"Functions of the program on {intervals} intervals, one call with all results",
        ("problem", "function", "instructions", "tapes [ms]", "CasADi [ms]", "ratio",
         "tapes [1e9 instructions/s]", "moved [GB/s]", "of multiply-adds [%]"),
        "Instructions of the blocks times their occurrences; sines and roots count as one. An "
        "instruction reads two numbers and writes one, in cache: beside the copy of 128 KB; the "
        "last column sets it beside the multiply-adds of the product of matrices.",
    )  # fmt: skip
    for problem in PROBLEMS:
        ours, theirs = ((problem, intervals, name) for name in ("shipped", "casadi"))
        if ours not in found or theirs not in found:
            continue
        for name in FUNCTIONS:
            mine = found[ours][0]["functions"][name]
            other = found[theirs][0]["functions"][name]["seconds"]
            seconds, count = max(mine["seconds"], 1e-9), mine["instructions"]
            rate = count / seconds / 1e9
            share = 100 * rate / (limits["dgemm_gflops"] / 2) if limits else None
            table.rows.append([problem, name, int(count), 1e3 * seconds, 1e3 * other,
                               other / seconds, rate, MOVED * rate, share])  # fmt: skip


def _growth(
    report: Report, found: dict[Key, tuple[dict[str, Any], Cost]], meshes: tuple[int, int]
) -> None:
    """Show how time and memory grow with the mesh."""
    small, large = meshes
    table = report.table(
        f"Growth from {small} to {large} intervals, of which there are {large / small:g} times "
        "as many",
        ("problem", "variant", "seconds per iteration", "factorisation", "peak memory"),
        "Ratios. Short phases bring in a few more intervals than asked for.",
    )
    for problem in PROBLEMS:
        for variant, name in VARIANTS.items():
            if any((problem, count, variant) not in found for count in meshes):
                continue
            ends = [found[problem, count, variant] for count in meshes]
            whole, inside = (
                [sample_of(result["parts"], key).median for result, _ in ends]
                for key in ("whole", "in_factorisation")
            )
            ratio = whole[1] / whole[0]
            memory = ends[1][1].peak / ends[0][1].peak
            table.rows.append([problem, name, ratio, inside[1] / max(inside[0], 1e-9), memory])
            if variant == "shipped":
                relative = ratio * small / large
                report.reached["growth"] = max(relative, report.reached.get("growth", 0.0))
