"""The files of an export: tables for any program, and all that OpenSim needs to repeat a run."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from pathwalker_cli.export.osim import osim_text
from pathwalker_cli.export.setup import external_loads_text, inverse_dynamics_text
from pathwalker_cli.export.tables import (
    control_table,
    ground_force_table,
    motion_table,
    net_torque_table,
    points,
    state_table,
)
from pathwalker_cli.io.opensim import write_opensim, write_trc
from pathwalker_cli.stride.series import GaitSeries

_DIGITS: Final = 12
"""Significant digits: OpenSim differentiates the motion twice."""

_TABLES: Final = {
    "motion.mot": motion_table,
    "ground_forces.mot": ground_force_table,
    "torques.sto": net_torque_table,
}
_OPENSIM_TABLES: Final = {"states.sto": state_table, "controls.sto": control_table}


def write_export(folder: Path, series: GaitSeries, opensim: bool) -> None:
    """Write a stride as other programs read it; for OpenSim also the walker and set-up files."""
    for file, table in (_TABLES | (_OPENSIM_TABLES if opensim else {})).items():
        write_opensim(folder / file, table(series), _DIGITS)
    write_trc(folder / "points.trc", points(series, folder.name))
    if opensim:
        texts = {
            "model.osim": osim_text(series.walker),
            "external_loads.xml": external_loads_text("ground_forces.mot"),
            "inverse_dynamics.xml": inverse_dynamics_text(
                "model.osim", "motion.mot", "external_loads.xml", series.duration
            ),
        }
        for file, text in texts.items():
            (folder / file).write_text(text, encoding="utf-8", newline="")
