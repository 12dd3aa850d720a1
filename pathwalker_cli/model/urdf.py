"""The patient's walker as a URDF, and that URDF as a Pinocchio model.

The pelvis hangs on the world by two sliders and a hinge, so that the joints are exactly
`conventions.COORDINATES`.  Heels and toes are links without mass; trunk, head and arms are welded.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import COORDINATES, GRAVITY, ROOT, SIDES, SUFFIX, Condition
from pathwalker_cli.model.anthropometry import Segment, Vector, segments
from pathwalker_cli.patient import Patient

__all__ = ["pinocchio_model", "urdf_text"]

_LIMITS: Final = '<limit lower="{0}" upper="{1}" effort="1000" velocity="100"/>'
_ANGLES: Final = _LIMITS.format(-3.2, 3.2)
_TRAVEL: Final = _LIMITS.format(-1000, 1000)
"""A URDF must state limits; those of the optimal control problems stand in the study's config."""

_ROOT_AXES: Final = {"pelvis_tx": "1 0 0", "pelvis_tz": "0 0 1", "pelvis_tilt": "0 1 0"}


def urdf_text(patient: Patient, condition: Condition, published: bool = False) -> str:
    """Return the walker as URDF text; the same input always gives the same bytes.

    Args:
        patient: The patient.
        condition: "barefoot" or "orthosis".
        published: Reproduce the published model's misplaced right lower arm and hand.
    """
    parts = segments(patient, condition, published)
    lines = [
        '<?xml version="1.0"?>',
        "<!-- Sagittal walker: x forward, z up, rotations about +y; m, kg, kg m^2, rad.",
        f"     Written by PathWalker from the patient {patient.id}; change that, not this. -->",
        f'<robot name="{patient.id}-{condition}">',
        '  <link name="world"/>',
        *_root(),
    ]
    for part in parts:
        lines += _link(part)
        if part.parent:
            lines += _joint(part.joint, part.parent, part.name, part.origin)
    for side in SIDES:
        suffix = SUFFIX[side]
        points = patient.contacts(condition)[side]
        for name, (x, z) in (("heel", points.heel), ("toe", points.toe)):
            lines.append(f'  <link name="{name}_{suffix}"/>')
            lines += _joint("", f"foot_{suffix}", f"{name}_{suffix}", (x, 0.0, z))
    return "\n".join([*lines, "</robot>", ""])


def pinocchio_model(patient: Patient, condition: Condition, published: bool = False) -> pin.Model:
    """Return the walker's Pinocchio model; its q is `conventions.COORDINATES` in order.

    Args:
        patient: The patient.
        condition: "barefoot" or "orthosis".
        published: Reproduce the published model's misplaced right lower arm and hand.
    """
    model = _ordered(pin.buildModelFromXML(urdf_text(patient, condition, published)))
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    return model


def _number(value: float) -> str:
    """Return a number with nine digits, without noise of the last bits."""
    return f"{value:.9g}" if value else "0"


def _vector(values: Vector) -> str:
    """Return three numbers as URDF text."""
    return " ".join(_number(value) for value in values)


def _link(part: Segment) -> list[str]:
    """Return the lines of a link with its inertia about its centre of mass."""
    xx, yy, zz = (_number(value) for value in part.inertia)
    return [
        f'  <link name="{part.name}">',
        "    <inertial>",
        f'      <origin xyz="{_vector(part.com)}"/>',
        f'      <mass value="{_number(part.mass)}"/>',
        f'      <inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>',
        "    </inertial>",
        "  </link>",
    ]


def _joint(name: str, parent: str, child: str, origin: Vector) -> list[str]:
    """Return the lines of a hinge about +y of that name, or of a weld if it has none."""
    head = f'name="{name}" type="revolute"' if name else f'name="{child}_weld" type="fixed"'
    lines = [
        f"  <joint {head}>",
        f'    <parent link="{parent}"/>',
        f'    <child link="{child}"/>',
        f'    <origin xyz="{_vector(origin)}"/>',
    ]
    if name:
        lines += ['    <axis xyz="0 1 0"/>', f"    {_ANGLES}"]
    return [*lines, "  </joint>"]


def _root() -> list[str]:
    """Return the three joints between world and pelvis with the empty links between them."""
    lines: list[str] = []
    parent = "world"
    for name in ROOT:
        turns = name == "pelvis_tilt"
        child = "pelvis" if turns else f"{name}_slider"
        if not turns:
            lines.append(f'  <link name="{child}"/>')
        lines += [
            f'  <joint name="{name}" type="{"revolute" if turns else "prismatic"}">',
            f'    <parent link="{parent}"/>',
            f'    <child link="{child}"/>',
            f'    <axis xyz="{_ROOT_AXES[name]}"/>',
            f"    {_ANGLES if turns else _TRAVEL}",
            "  </joint>",
        ]
        parent = child
    return lines


def _ordered(parsed: pin.Model) -> pin.Model:
    """Return the same model with its joints in the order of `COORDINATES`.

    The parser sorts the children of a link by name, which puts the left leg before the right one.
    """
    model: Any = pin.Model()
    model.name = parsed.name
    new_index = {0: 0}
    for name in COORDINATES:
        old = parsed.getJointId(name)
        parent = new_index[parsed.parents[old]]
        placement = parsed.jointPlacements[old]
        index = model.addJoint(parent, parsed.joints[old], placement, name)
        model.appendBodyToJoint(index, parsed.inertias[old], pin.SE3.Identity())
        new_index[old] = index
    frame_index = {0: 0}
    for old, frame in enumerate(parsed.frames):
        if old == 0:
            continue
        frame_index[old] = model.addFrame(
            pin.Frame(
                frame.name,
                new_index[frame.parentJoint],
                frame_index[frame.parentFrame],
                frame.placement,
                frame.type,
            ),
            False,
        )
    return model
