"""The stride in 3D in a browser, by Pinocchio's viewer for MeshCat."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from typing import Final

import coal
import numpy as np
import pinocchio as pin
from pinocchio.visualize import MeshcatVisualizer

from pathwalker_cli.conventions import SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import body_points

_RATE: Final = 60.0
"""Pictures per second [1/s]."""
_EYE: Final = [1.2, 0.9, 2.0]
"""Where MeshCat looks from at first: ahead of the walker, above the ground, to its right [m]."""
_ACROSS: Final[dict[Side, float]] = {"right": -0.07, "left": 0.07}
"""Where the legs of the flat model are drawn, + = to the left [m]."""
_THIGH, _SHANK, _FOOT, _PELVIS, _TRUNK = 0.035, 0.027, 0.012, 0.05, 0.055
_SHELL: Final = 0.04
"""Radii [m]."""
_SHADES: Final[dict[Side, float]] = {"right": 0.25, "left": 0.7}
_BLUE: Final = np.array([0.34, 0.71, 0.91, 0.6])


def poses(series: GaitSeries, seconds: np.ndarray) -> np.ndarray:
    """Return the walker at some times [s], shape (n, 10), on the spot as on a treadmill."""
    share = np.asarray(seconds) / series.duration % 1.0
    q = np.stack([np.interp(share * series.duration, series.time, c) for c in series.q.T], axis=1)
    q[:, 0] -= series.q[0, 0] + share * series.distance
    return q


def walker_geometry(walker: Walker) -> pin.GeometryModel:
    """Return capsules and balls on the bodies of a walker; a worn orthosis is blue."""
    geometry, data = pin.GeometryModel(), walker.model.createData()
    pin.forwardKinematics(walker.model, data, np.zeros(walker.model.nq))
    for name, joint, shape, upright, colour in _parts(walker):
        number = walker.model.getJointId(joint)
        placement = pin.SE3(data.oMi[number].rotation.T, np.zeros(3)) * upright
        made = pin.GeometryObject(name, number, placement, shape)
        made.meshColor = colour
        geometry.addGeometryObject(made)
    return geometry


def open_viewer(walker: Walker) -> MeshcatVisualizer:
    """Return a viewer of a walker with a server of its own on this machine.

    Raises:
        DataError: If MeshCat is not installed.
    """
    try:
        import meshcat  # noqa: F401
    except ImportError:
        raise DataError(
            "the view in 3D needs MeshCat, which is not there", mend="run: pip install meshcat"
        ) from None
    viewer = MeshcatVisualizer(walker.model, None, walker_geometry(walker))
    with redirect_stdout(StringIO()):  # it tells its address, as the command does
        viewer.initViewer(loadModel=True)
    viewer.setBackgroundColor("white")
    viewer.viewer["/Cameras/default/rotated/<object>"].set_property("position", _EYE)
    return viewer


def show(viewer: MeshcatVisualizer, series: GaitSeries, strides: int | None) -> None:
    """Play a stride in real time, over and over if no number of strides is given."""
    start = time.monotonic()
    passed = 0.0
    while strides is None or passed < strides * series.duration:
        viewer.display(poses(series, np.array([passed]))[0])
        time.sleep(1.0 / _RATE)
        passed = time.monotonic() - start


_Part = tuple[str, str, coal.CollisionGeometry, pin.SE3, np.ndarray]


def _parts(walker: Walker) -> Iterator[_Part]:
    """Yield name, joint, shape, place from the joint, upright, and colour of all that is drawn."""
    points = body_points(walker, np.zeros(walker.skeleton.size))
    for side in SIDES:
        yield from _leg(points, side, side in walker.device.elements)
    dark = _grey(_SHADES["right"])
    hips = [np.array([0.0, y, 0.0]) for y in _ACROSS.values()]
    above = _between(points, "hip_r", "lumbar")
    yield "pelvis", "pelvis_tilt", *_capsule(hips[0], hips[1], _PELVIS), dark
    yield "back", "pelvis_tilt", *_capsule(np.zeros(3), above, _PELVIS), dark
    neck = _between(points, "lumbar", "neck")
    yield "trunk", "lumbar", *_capsule(np.zeros(3), neck, _TRUNK), dark
    head = _between(points, "lumbar", "head")
    radius = float(np.linalg.norm(points["head"] - points["neck"]))
    yield "head", "lumbar", coal.Sphere(radius), pin.SE3(np.eye(3), head), dark


def _leg(points: dict[str, np.ndarray], side: Side, with_orthosis: bool) -> Iterator[_Part]:
    """Yield the parts of a leg."""
    s, across, colour = SUFFIX[side], np.array([0.0, _ACROSS[side], 0.0]), _grey(_SHADES[side])
    knee = _between(points, f"hip_{s}", f"knee_{s}")
    ankle = _between(points, f"knee_{s}", f"ankle_{s}")
    up = np.array([0.0, 0.0, _FOOT])
    heel, toe = (_between(points, f"ankle_{s}", f"{end}_{s}") + up for end in ("heel", "toe"))
    lines = [
        ("thigh", "hip", np.zeros(3), knee, _THIGH, colour),
        ("shank", "knee", np.zeros(3), ankle, _SHANK, colour),
        ("sole", "ankle", heel, toe, _FOOT, _BLUE if with_orthosis else colour),
        ("heel", "ankle", np.zeros(3), heel, _FOOT, colour),
        ("instep", "ankle", np.zeros(3), toe, _FOOT, colour),
    ]
    if with_orthosis:
        own = f"hinge_{s}" in points
        top = _between(points, f"hinge_{s}", f"shell_knee_{s}") if own else np.zeros(3)
        start, end = (top + share * ankle for share in (0.54, 0.86))
        lines.append(("shell", "hinge" if own else "knee", start, end, _SHELL, _BLUE))
    if f"tip_{s}" in points:
        toes = _between(points, f"toe_{s}", f"tip_{s}")
        lines.append(("toes", "mtp", up, toes + up, _FOOT, colour))
    for name, joint, start, end, radius, shade in lines:
        shape, place = _capsule(start + across, end + across, radius)
        yield f"{name}_{s}", f"{joint}_{s}", shape, place, shade


def _between(points: dict[str, np.ndarray], start: str, end: str) -> np.ndarray:
    """Return the way between two points in the zero pose, where all links stand upright [m]."""
    x, z = points[end] - points[start]
    return np.array([x, 0.0, z])


def _capsule(start: np.ndarray, end: np.ndarray, radius: float) -> tuple[coal.Capsule, pin.SE3]:
    """Return a capsule between two points of a link and its place there."""
    way = end - start
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), way).toRotationMatrix()
    return coal.Capsule(radius, float(np.linalg.norm(way))), pin.SE3(turn, (start + end) / 2.0)


def _grey(shade: float) -> np.ndarray:
    """Return an opaque grey."""
    return np.array([shade, shade, shade, 1.0])
