"""Set-up files of OpenSim: external loads, and the inverse dynamics tool."""

from __future__ import annotations

from collections.abc import Iterable

from pathwalker_cli.conventions import SIDES, SUFFIX
from pathwalker_cli.export.xml import Node, document, node, numbers


def external_loads_text(forces: str) -> str:
    """Return what applies a file's forces, see `io.opensim.force_table`, to the feet."""
    feet = node("objects", *_feet())
    return document(node("ExternalLoads", feet, name="ground_forces", datafile=forces))


def _feet() -> Iterable[Node]:
    for side in SIDES:
        foot = SUFFIX[side]
        yield node(
            "ExternalForce",
            name=f"{side}_foot",
            applied_to_body=f"foot_{foot}",
            force_expressed_in_body="ground",
            point_expressed_in_body="ground",
            force_identifier=f"ground_force_{foot}_v",
            point_identifier=f"ground_force_{foot}_p",
            torque_identifier=f"ground_torque_{foot}_",
        )


def inverse_dynamics_text(model: str, motion: str, loads: str, duration: float) -> str:
    """Return the set-up of the inverse dynamics tool over a stride [s], without any filter.

    The model's own forces are left out: what it finds are muscles, tissue and orthoses together.
    """
    tool = node(
        "InverseDynamicsTool",
        name="inverse_dynamics",
        results_directory=".",
        model_file=model,
        time_range=numbers(0.0, duration),
        forces_to_exclude="ALL",
        external_loads_file=loads,
        coordinates_file=motion,
        lowpass_cutoff_frequency_for_coordinates="-1",
        output_gen_force_file="inverse_dynamics.sto",
    )
    return document(tool)
