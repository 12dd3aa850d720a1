"""The walker as an OpenSim model: bodies, joints, actuators, orthoses and feet.

OpenSim's axes: x forward, y up, z to the right.  Every hinge turns about -z, which is the left of
`model.skeleton`, so coordinates keep their names and signs; `pelvis_tz` moves along OpenSim's y.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from pathwalker_cli.conventions import GRAVITY, ROOT, SUFFIX
from pathwalker_cli.errors import InputError
from pathwalker_cli.export.xml import Node, collection, document, node, numbers, place
from pathwalker_cli.model.anthropometry import Segment, Vector, segments
from pathwalker_cli.model.contact import ContactPoint
from pathwalker_cli.model.elements.curves import evaluate, samples
from pathwalker_cli.model.elements.orthosis import AnkleOrthosis, orthosis_curve
from pathwalker_cli.model.skeleton import EVERY_JOINT, Joint
from pathwalker_cli.model.urdf import point_place
from pathwalker_cli.model.walker import Walker

_AXES: Final[dict[str, Vector]] = {
    axis: place(unit) for axis, unit in zip("xyz", np.eye(3).tolist(), strict=True)
}
"""Axes of the skeleton in OpenSim's."""

_ROTATIONS: Final[tuple[Vector, ...]] = (_AXES["y"], (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
_TRANSLATIONS: Final[tuple[Vector, ...]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Axes of a custom joint in order."""

_PELVIS_JOINT: Final = "ground_pelvis"
_RANGE: Final = {True: (-1000.0, 1000.0), False: (-np.pi, np.pi)}
"""Of sliders [m] and hinges [rad]: OpenSim must be given one; nothing is clamped to it."""

_THICKNESS: Final = 0.2
"""Of a segment as it is drawn, as a share of its length."""
_SAMPLES: Final = 40
"""Samples of a piece of the orthosis curve: a spline through them is off by some 3e-6 N m."""
_BEYOND: Final = 2.0 ** np.arange(1, 17) - 1.0
"""Further samples on its straight ends, in steps that double: a spline through them is straight."""


def osim_text(walker: Walker) -> str:
    """Return the walker, with its numbers, as the text of an .osim file.

    A muscle torque generator is a coordinate actuator whose optimal force is its strength with its
    sign [N m], tissue of the joints one of 1 N m per coordinate; an orthosis is a rotational
    bushing between shank and foot; heels and toes are markers, as joints are, and spheres where
    feet roll.

    Raises:
        InputError: If an orthosis is a body of its own.
    """
    if walker.shelled:
        raise InputError(
            "an orthosis that is a body of its own cannot be written for OpenSim, whose bushings "
            "turn with both bodies",
            allowed="runs with model.orthosis glued, or an export without --opensim",
        )
    parts = segments(
        walker.patient, walker.condition, walker.published, walker.values, walker.skeleton
    )
    orthoses = (_orthosis(element, walker) for element in walker.device.elements.values())
    model = node(
        "Model",
        collection("BodySet", "bodyset", map(_body, parts)),
        collection("JointSet", "jointset", map(_joint, parts)),
        collection("ForceSet", "forceset", [*_actuators(walker), *orthoses]),
        collection("MarkerSet", "markerset", _markers(parts, walker)),
        collection("ContactGeometrySet", "contactgeometryset", _contact_geometry(walker)),
        name=f"{walker.patient.id}-{walker.condition}",
        credits="Written by PathWalker. x forward, y up, z to the right; m, kg, rad, N.",
        length_units="meters",
        force_units="N",
        gravity=numbers(0.0, -GRAVITY, 0.0),
    )
    return document(model)


def joint_path(coordinate: str) -> str:
    """Return the path of a coordinate in the model."""
    return f"/jointset/{_PELVIS_JOINT if coordinate in ROOT else coordinate}/{coordinate}"


def optimal_forces(walker: Walker) -> dict[str, tuple[str, float]]:
    """Return coordinate and optimal force [N m] of the model's actuators by name.

    Those of the muscles come first, then those of other tissue.
    """
    strengths = zip(walker.muscles, walker.max_isometric_torque.tolist(), strict=True)
    muscles = {m.name: (m.coordinates[0], m.torque_sign * tau) for m, tau in strengths}
    tissue = [name for element in walker.tissue for name in element.coordinates]
    return muscles | {f"passive_{name}": (name, 1.0) for name in tissue}


def _body(part: Segment) -> Node:
    """Return a body with its inertia about its centre of mass, and an ellipsoid to be seen."""
    centre, (xx, yy, zz) = place(part.com), part.inertia
    thick = _THICKNESS * part.length
    radii = (part.length / 2.0 if along else thick / 2.0 for along in centre)
    shape = node(
        "PhysicalOffsetFrame",
        node("attached_geometry", node("Ellipsoid", name="ellipsoid", radii=numbers(*radii))),
        name=f"{part.name}_shape",
        socket_parent="..",
        translation=numbers(*centre),
    )
    return node(
        "Body",
        node("components", shape),
        name=part.name,
        mass=numbers(part.mass),
        mass_center=numbers(*centre),
        inertia=numbers(xx, zz, yy, 0.0, 0.0, 0.0),
    )


def _joint(part: Segment) -> Node:
    """Return the joint of a segment and its parent: of the pelvis, a hinge, or a weld."""
    parent, origin = f"/bodyset/{part.parent}" if part.parent else "/ground", f"{part.name}_origin"
    frame = node(
        "PhysicalOffsetFrame",
        name=origin,
        socket_parent=parent,
        translation=numbers(*place(part.origin)),
    )
    ends = {"socket_parent_frame": origin, "socket_child_frame": f"/bodyset/{part.name}"}
    if part.parent and not part.joint:
        return node("WeldJoint", node("frames", frame), name=f"{part.name}_weld", **ends)
    names = (part.joint,) if part.parent else ROOT
    joints = [joint for joint in EVERY_JOINT.joints if joint.coordinate in names]
    return node(
        "CustomJoint",
        node("frames", frame),
        node("coordinates", *map(_coordinate, joints)),
        node("SpatialTransform", *_axes(joints)),
        name=part.joint or _PELVIS_JOINT,
        **ends,
    )


def _coordinate(joint: Joint) -> Node:
    span = numbers(*_RANGE[joint.slides])
    return node("Coordinate", name=joint.coordinate, range=span, clamped="false")


def _axes(joints: Sequence[Joint]) -> Iterable[Node]:
    """Return the six axes of a custom joint; a coordinate moves along or about its own."""
    movers = {(joint.slides, _AXES[joint.axis]): joint.coordinate for joint in joints}
    for kind, slides, axes in (
        ("rotation", False, _ROTATIONS),
        ("translation", True, _TRANSLATIONS),
    ):
        for number, axis in enumerate(axes, 1):
            mover = movers.get((slides, axis), "")
            moved = node("LinearFunction", coefficients="1 0")
            yield node(
                "TransformAxis",
                node("function", moved if mover else node("Constant", value="0")),
                name=f"{kind}{number}",
                coordinates=mover,
                axis=numbers(*axis),
            )


def _actuators(walker: Walker) -> Iterable[Node]:
    """Return the actuators; muscles pull one way only."""
    muscles = {muscle.name for muscle in walker.muscles}
    for name, (coordinate, force) in optimal_forces(walker).items():
        limit = {"min_control": "0"} if name in muscles else {}
        optimal = numbers(force)
        yield node(
            "CoordinateActuator", name=name, coordinate=coordinate, optimal_force=optimal, **limit
        )


def _orthosis(element: AnkleOrthosis, walker: Walker) -> Node:
    """Return a bushing that resists the rotation of the ankle, about z, as the orthosis does."""
    chain = orthosis_curve(element.fixed(walker.values), *element.springs(walker.values))
    inner = samples(chain, _SAMPLES)
    below = inner[0] - _BEYOND[::-1] * (inner[1] - inner[0])
    above = inner[-1] + _BEYOND * (inner[-1] - inner[-2])
    angle = np.concatenate([below, inner, above])
    turn, moment = -angle[::-1], -np.asarray(evaluate(chain, angle).value)[::-1]
    (ankle,), foot = element.coordinates, f"foot_{SUFFIX[element.side]}"
    return node(
        "FunctionBasedBushingForce",
        node("m_z_theta_z_function", node("SimmSpline", x=numbers(*turn), y=numbers(*moment))),
        name=element.name,
        socket_frame1=f"/jointset/{ankle}/{foot}_origin",
        socket_frame2=f"/bodyset/{foot}",
    )


def _markers(parts: Sequence[Segment], walker: Walker) -> Iterable[Node]:
    """Return a marker at every hinge, heel and toe."""
    hinges = [(part.joint, part.name, (0.0, 0.0, 0.0)) for part in parts if part.joint]
    feet = [(point.name, point.link, _foot_point(point, walker)) for point in walker.parts.frames]
    for name, body, where in (*hinges, *feet):
        yield node(
            "Marker",
            name=name,
            socket_parent_frame=f"/bodyset/{body}",
            location=numbers(*where),
            fixed="true",
        )


def _contact_geometry(walker: Walker) -> Iterable[Node]:
    """Return the floor, and of feet that roll the circles of heel and toe as spheres."""
    yield node(
        "ContactHalfSpace",
        name="floor",
        socket_frame="/ground",
        orientation=numbers(0.0, 0.0, -np.pi / 2.0),
    )
    for point, radius in zip(walker.parts.frames, walker.shapes, strict=False):
        forward, up, right = _foot_point(point, walker)
        yield node(
            "ContactSphere",
            name=f"{point.name}_sphere",
            socket_frame=f"/bodyset/{point.link}",
            location=numbers(forward, up + radius, right),
            radius=numbers(radius),
        )


def _foot_point(point: ContactPoint, walker: Walker) -> Vector:
    forward, up = point_place(walker.patient, walker.condition, point)
    return place((forward, 0.0, up))
