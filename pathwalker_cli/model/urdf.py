"""The patient's walker as a URDF, and that URDF as a Pinocchio model.

The pelvis hangs on the world by two sliders and a hinge, so that the joints are exactly
those of the skeleton.  Heels and toes are links without mass; trunk, head and arms are welded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import GRAVITY, Condition
from pathwalker_cli.model.anthropometry import Segment, Vector, segments
from pathwalker_cli.model.contact import POINTS, TIPS, ContactPoint
from pathwalker_cli.model.skeleton import PLANAR_WALKER, Joint, Skeleton
from pathwalker_cli.patient import Patient

_LIMITS: Final = '<limit lower="{0}" upper="{1}" effort="1000" velocity="100"/>'
_ANGLES: Final = _LIMITS.format(-3.2, 3.2)
_TRAVEL: Final = _LIMITS.format(-1000, 1000)
"""A URDF must state limits; those of the optimal control problems stand in the study's config."""

_AXES: Final = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1", "-y": "0 -1 0"}
_REVERSED: Final = pin.SE3(np.diag([-1.0, -1.0, 1.0]), np.zeros(3))
"""A half turn about z, in which a hinge about -y is one about y."""


def urdf_text(
    patient: Patient,
    condition: Condition,
    published: bool = False,
    values: Mapping[str, float] | None = None,
    skeleton: Skeleton = PLANAR_WALKER,
) -> str:
    """Return the walker as URDF text; the same input always gives the same bytes.

    Arguments are those of `anthropometry.segments`.
    """
    lines = [
        '<?xml version="1.0"?>',
        "<!-- Sagittal walker: x forward, z up, rotations about +y; m, kg, kg m^2, rad.",
        f"     Written by PathWalker from the patient {patient.id}; change that, not this. -->",
        f'<robot name="{patient.id}-{condition}">',
        '  <link name="world"/>',
        *(line for joint in skeleton.joints if joint.root for line in _hung(joint)),
    ]
    axes = {joint.coordinate: joint.axis for joint in skeleton.joints}
    for part in segments(patient, condition, published, values, skeleton):
        lines += _link(part)
        if part.parent:
            axis = axes.get(part.joint, "y")
            lines += _joint(part.joint, part.parent, part.name, part.origin, axis)
    tips = (tip for tip in TIPS if tip.link in skeleton.links)
    for point in (*POINTS, *tips):
        x, z = point_place(patient, condition, point)
        lines.append(f'  <link name="{point.name}"/>')
        lines += _joint("", point.link, point.name, (x, 0.0, z))
    return "\n".join([*lines, "</robot>", ""])


def pinocchio_model(
    patient: Patient,
    condition: Condition,
    published: bool = False,
    values: Mapping[str, float] | None = None,
    skeleton: Skeleton = PLANAR_WALKER,
) -> pin.Model:
    """Return the walker's Pinocchio model; arguments as of `urdf_text`; q as in the skeleton."""
    text = urdf_text(patient, condition, published, values, skeleton)
    model = _ordered(pin.buildModelFromXML(text), skeleton)
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    return model


def frame_positions(model: pin.Model, q: np.ndarray, frames: Sequence[str]) -> np.ndarray:
    """Return where k frames are, forward and up [m], in poses (..., n): shape (..., k, 2)."""
    data: Any = model.createData()
    places = [model.getFrameId(frame) for frame in frames]
    positions = np.empty((q.size // model.nq, len(frames), 3))
    for row, pose in enumerate(q.reshape(-1, model.nq)):
        pin.forwardKinematics(model, data, pose)
        positions[row] = [pin.updateFramePlacement(model, data, k).translation for k in places]
    return positions[..., [0, 2]].reshape(*q.shape[:-1], len(frames), 2)


def point_place(patient: Patient, condition: Condition, point: ContactPoint) -> tuple[float, float]:
    """Return where a point is in the frame of its link: forward, up [m]."""
    if point.soft:
        return patient.toes_length(point.side), 0.0
    x, z = getattr(patient.contacts(condition)[point.side], point.place)
    return float(x), float(z)


def _numbers(values: Iterable[float]) -> str:
    """Return numbers with nine digits, without noise of the last bits."""
    return " ".join(f"{value:.9g}" if value else "0" for value in values)


def _link(part: Segment) -> list[str]:
    """Return the lines of a link with its inertia about its centre of mass."""
    xx, yy, zz = _numbers(part.inertia).split()
    return [
        f'  <link name="{part.name}">',
        "    <inertial>",
        f'      <origin xyz="{_numbers(part.com)}"/>',
        f'      <mass value="{_numbers([part.mass])}"/>',
        f'      <inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>',
        "    </inertial>",
        "  </link>",
    ]


def _joint(name: str, parent: str, child: str, origin: Vector, axis: str = "y") -> list[str]:
    """Return the lines of a hinge of that name about an axis, or of a weld if it has none."""
    head = f'name="{name}" type="revolute"' if name else f'name="{child}_weld" type="fixed"'
    lines = [
        f"  <joint {head}>",
        f'    <parent link="{parent}"/>',
        f'    <child link="{child}"/>',
        f'    <origin xyz="{_numbers(origin)}"/>',
    ]
    if name:
        lines += [f'    <axis xyz="{_AXES[axis]}"/>', f"    {_ANGLES}"]
    return [*lines, "  </joint>"]


def _hung(joint: Joint) -> list[str]:
    """Return a joint of the root and its empty link; the pelvis is written with the segments."""
    return [
        *([f'  <link name="{joint.child}"/>'] if joint.slides else []),
        f'  <joint name="{joint.coordinate}" type="{"prismatic" if joint.slides else "revolute"}">',
        f'    <parent link="{joint.parent}"/>',
        f'    <child link="{joint.child}"/>',
        f'    <axis xyz="{_AXES[joint.axis]}"/>',
        f"    {_TRAVEL if joint.slides else _ANGLES}",
        "  </joint>",
    ]


def _ordered(parsed: pin.Model, skeleton: Skeleton) -> pin.Model:
    """Return the same model with its joints in the order of the skeleton.

    The parser sorts the children of a link by name, which puts the left leg before the right one.
    Hinges about -y become hinges about y in frames that are turned by half a turn.
    """
    model: Any = pin.Model()
    model.name = parsed.name
    new_index, turns = {0: 0}, {0: pin.SE3.Identity()}
    for each in skeleton.joints:
        old = parsed.getJointId(each.coordinate)
        parent, back = parsed.parents[old], each.axis == "-y"
        turn = turns[old] = _REVERSED if back else pin.SE3.Identity()
        kind = pin.JointModelRY() if back else parsed.joints[old]
        placement = turns[parent].inverse() * parsed.jointPlacements[old] * turn
        new_index[old] = model.addJoint(new_index[parent], kind, placement, each.coordinate)
        model.appendBodyToJoint(new_index[old], parsed.inertias[old], turn.inverse())
    frame_index = {0: 0}
    for old, frame in enumerate(parsed.frames[1:], 1):
        joint, above = new_index[frame.parentJoint], frame_index[frame.parentFrame]
        placement = turns[frame.parentJoint].inverse() * frame.placement
        moved = pin.Frame(frame.name, joint, above, placement, frame.type)
        frame_index[old] = model.addFrame(moved, False)
    return model
