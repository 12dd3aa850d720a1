"""A trade-off as a table on the terminal."""

from __future__ import annotations

from typing import Final

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff

__all__ = ["tradeoff_lines"]

_MESHES: Final = {
    "base": "mesh of the base",
    "refined": "finer mesh",
    "inaccurate": "mesh too coarse",
}


def tradeoff_lines(tradeoff: Tradeoff) -> list[str]:
    """Return the table and what it took, line by line."""
    springs = tradeoff.condition == "orthosis"
    heading = ["weight", "speed", "effort", *(["K_D r", "K_D l", "K_P r", "K_P l"] * springs)]
    units = ["s^2/m^2", "m/s", "s/m", *(["N m/rad"] * 4 * springs)]
    lines = ["".join(f"{cell:>9}" for cell in row) for row in (heading, units)]
    lines += [_line(tradeoff, point, springs) for point in tradeoff.points]
    return [*lines, "", *(f"{label:<22}{text}" for label, text in _notes(tradeoff))]


def _line(tradeoff: Tradeoff, point: FrontPoint, springs: bool) -> str:
    """Return one row of the table."""
    if not point.solved:
        return f"{point.weight:9.3g}  {point.status}"
    cells = [f"{point.weight:9.3g}", f"{point.speed:9.3f}", f"{point.effort:9.4f}"]
    cells += [f"{point.measures[name]:9.1f}" for name in STIFFNESSES if springs]
    mesh = f"{_MESHES[point.mesh_status]}, {point.intervals} intervals"
    errors = f"errors {point.errors[0]:.1e} rad or m, {point.errors[1]:.1e} rad/s or m/s"
    notes = [mesh, errors]
    notes += [point.status] * (point.status != "converged")
    notes += ["dominated"] * tradeoff.dominated(point)
    return f"{''.join(cells)}   {'; '.join(notes)}"


def _notes(tradeoff: Tradeoff) -> list[tuple[str, str]]:
    """Return label and text of what to know about the table."""
    coarse = [f"{p.weight:g}" for p in tradeoff.solved if p.mesh_status == "inaccurate"]
    allowed = "{:g} rad or m, {:g} rad/s or m/s".format(*tradeoff.tolerances)
    rows = [("front", f"{len(tradeoff.front)} of {len(tradeoff.points)} points; a dominated point "
             "is no faster and no cheaper than another one")]  # fmt: skip
    if tradeoff.recorded is not None:
        low, high = tradeoff.recorded
        rows.append(("recorded speed", f"{low:.2f} to {high:.2f} m/s, {tradeoff.condition}"))
    rows.append(("re-integration error", f"allowed {allowed}; " + (
        f"exceeded at weight {', '.join(coarse)}: take these numbers as rough" if coarse
        else "met by every point with a solution")))  # fmt: skip
    done = "nothing new" if tradeoff.complete else "still new optima"
    rows.append(("solves", f"{tradeoff.solves} on the mesh of the base, {tradeoff.failed_solves} "
                 f"without a solution; {tradeoff.median_iterations:.0f} iterations in the median; "
                 f"{tradeoff.sweeps} sweeps, the last found {done}"))  # fmt: skip
    rows.append(("seconds", f"{tradeoff.seconds:.0f} on the mesh of the base, "
                 f"{tradeoff.seconds_refined:.0f} on finer meshes"))  # fmt: skip
    return rows
