"""The drawn walker: shapes that hang on points of the body, for every kind of animation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from pathwalker_cli.animation.frames import GaitFrames
from pathwalker_cli.conventions import GENERATORS, SIDES, SUFFIX, Side
from pathwalker_cli.stride.figures.style import FORCE_LENGTH

Kind = Literal["leg", "foot", "trunk", "head", "muscle", "shell", "spring", "recorded", "marker"]

_LINE: Final = np.array([[0.0, 0.0], [1.0, 0.0]])

_MUSCLE_PLACES: Final = {
    "hip_extension": ("hip", "knee", 0.03, 0.45, -1),
    "hip_flexion": ("hip", "knee", 0.03, 0.45, 1),
    "knee_extension": ("hip", "knee", 0.55, 0.97, 1),
    "knee_flexion": ("hip", "knee", 0.55, 0.97, -1),
    "ankle_extension": ("knee", "ankle", 0.08, 0.5, -1),
    "ankle_flexion": ("knee", "ankle", 0.08, 0.5, 1),
    "lumbar_extension": ("lumbar", "neck", 0.03, 0.4, -1),
    "lumbar_flexion": ("lumbar", "neck", 0.03, 0.4, 1),
}
"""Segment from point to point, beginning and end on it, and its side: + is left of the way."""

_MUSCLE_GAP: Final = 0.012
_MUSCLE_WIDTH: Final = 0.026
"""Distance of a muscle from the segment and its greatest width [m]."""

_SHELL: Final = (0.54, 0.86, 0.03)
"""Shell at the shank: beginning and end as shares of the shank, half its depth [m]."""
_SOLE: Final = (-0.08, 1.0, 0.016, 0.05)
"""Shell under the foot: rear and front from heel to toe, thickness and height of its cup [m]."""
_COILS: Final = 5
_COIL_WIDTH: Final = 0.024
"""Zigzags of a drawn spring and their width [m]."""

_TOES: Final = 0.012
"""Thickness of toes at the ball of the foot [m]."""

_DOT: Final = 0.009
"""Radius of a marker: a little more than those that are worn [m]."""

_SHAFT, _HEAD_WIDTH, _HEAD_LENGTH = 0.012, 0.036, 0.045
"""Size of an arrow [m]; a short arrow has a shorter head."""

_MARGIN: Final = 0.06
"""Free space around the walker [m]."""
_BELOW: Final = 0.11
"""Height of the strip below the ground, where the distance stands [m]."""


@dataclass(frozen=True)
class Shape:
    """A line or an area between two points of the body.

    Args:
        kind: What it stands for.
        start: Point where it begins.
        end: Point where it ends.
        outline: Corners, shape (k, 2): the share of the way from start to end, and the distance to
            the left of that way [m].
        closed: Whether it is an area.
        side: Leg that it belongs to; None for the trunk.
        generator: Position in `conventions.GENERATORS` of a muscle.
    """

    kind: Kind
    start: str
    end: str
    outline: np.ndarray
    closed: bool = False
    side: Side | None = None
    generator: int | None = None

    def at(self, points: Mapping[str, np.ndarray], i: int) -> np.ndarray:
        """Return its corners at instant i (forward, up) [m], shape (k, 2)."""
        return _placed(self.outline, points[self.start][i], points[self.end][i])


@dataclass(frozen=True)
class Drawing:
    """A stride with what is drawn of it.

    Args:
        frames: The stride.
        points: Its points and those that shapes need besides [m], shape (n, 2) each.
        shapes: What is drawn, from back to front.
        arrows: Corners of the arrow of each ground force [m], shape (n, 7, 2); NaN without load.
    """

    frames: GaitFrames
    points: Mapping[str, np.ndarray]
    shapes: tuple[Shape, ...]
    arrows: Mapping[Side, np.ndarray]


@dataclass(frozen=True)
class View:
    """What is seen of the plane of walking, from an eye that moves on with the mean speed.

    Args:
        half_width: Distance from the middle to either edge [m].
        bottom: Lower edge [m], negative: the ground is at 0.
        top: Upper edge [m].
    """

    half_width: float
    bottom: float
    top: float


def drawing(frames: GaitFrames) -> Drawing:
    """Return what is drawn of a stride."""
    points = {**frames.points, **_spring_ends(frames.points, frames.braced)}
    left, right = (_leg(points, side, side in frames.braced) for side in ("left", "right"))
    behind, dots, more = _recorded(frames)
    points |= more
    return Drawing(
        frames=frames,
        points=points,
        shapes=(*behind, *left, *_trunk(points), *right, *dots),
        arrows={side: _arrows(frames, side) for side in SIDES},
    )


def common_view(drawings: Sequence[Drawing]) -> View:
    """Return a view that holds every instant of every stride; it is at least as wide as high."""
    wide = top = 0.0
    for each in drawings:
        frames = each.frames
        eye = frames.eye[:, None]
        placed = (*(p[:, None] for p in each.points.values()), *each.arrows.values())
        wide = max(wide, *(float(np.nanmax(np.abs(p[..., 0] - eye))) for p in placed))
        head, neck = frames.points["head"], frames.points["neck"]
        crown = float((head[:, 1] + np.linalg.norm(head - neck, axis=1)).max())
        top = max(top, *(float(np.nanmax(p[..., 1])) for p in placed), crown)
    top += _MARGIN
    return View(max(wide + _MARGIN, (top + _BELOW) / 2), -_BELOW, top)


def force_scale(frames: GaitFrames) -> float:
    """Return the length of the arrow of one newton [m/N]."""
    return FORCE_LENGTH * frames.pelvis_height / frames.weight


def words(name: str) -> str:
    """Return the name of a phase or a generator as words, e.g. "right toe, left heel"."""
    name = re.sub(r"_r$", "_right", re.sub(r"_l$", "_left", name))
    return re.sub(r"_(right|left)", r", \1", name).replace("_", " ")


def _placed(outline: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return corners on the way between two points [m], shape (k, 2)."""
    way = end - start
    left = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    return start + outline[:, :1] * way + outline[:, 1:] * left


def _leg(points: Mapping[str, np.ndarray], side: Side, with_orthosis: bool) -> tuple[Shape, ...]:
    """Return the shapes of a leg, from back to front."""
    s = SUFFIX[side]
    chain = ("lumbar", f"hip_{s}", f"knee_{s}", f"ankle_{s}")
    bones = [Shape("leg", a, b, _LINE, side=side) for a, b in pairwise(chain)]
    foot = Shape("foot", f"heel_{s}", f"toe_{s}", _foot(points, s), closed=True, side=side)
    if f"tip_{s}" in points:
        wedge = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, _TOES]])
        bones.append(Shape("foot", f"toe_{s}", f"tip_{s}", wedge, closed=True, side=side))
    shank, sole = _shells()
    orthosis = (
        Shape("shell", *_shank_of_shell(points, s), shank, closed=True, side=side),
        Shape("shell", f"heel_{s}", f"toe_{s}", sole, closed=True, side=side),
        Shape("spring", f"spring_top_{s}", f"spring_foot_{s}", _zigzag(), side=side),
    )
    muscles = _muscles(points, ("hip", "knee", "ankle"), f"_{s}", side)
    return (foot, *bones, *(orthosis if with_orthosis else ()), *muscles)


def _trunk(points: Mapping[str, np.ndarray]) -> tuple[Shape, ...]:
    """Return trunk and head with the muscles of the trunk."""
    turn = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    radius = float(np.linalg.norm(points["head"][0] - points["neck"][0]))
    circle = np.stack([1.0 + np.cos(turn), radius * np.sin(turn)], axis=1)
    return (
        Shape("trunk", "lumbar", "neck", _LINE),
        Shape("head", "neck", "head", circle, closed=True),
        *_muscles(points, ("lumbar",), "", None),
    )


def _recorded(frames: GaitFrames) -> tuple[list[Shape], list[Shape], dict[str, np.ndarray]]:
    """Return a recorded cycle as lines behind the stride, its markers, and the points of both."""
    lines: list[Shape] = []
    dots: list[Shape] = []
    points: dict[str, np.ndarray] = {}
    if frames.recorded is None:
        return lines, dots, points
    eye = np.stack([frames.eye, np.zeros(frames.count)], axis=1)
    for name, path in frames.recorded.points.items():
        points[f"recorded {name}"] = path + eye
    chains: list[tuple[Side | None, tuple[str, ...]]] = [(None, ("lumbar", "neck", "head"))]
    for side in SIDES:
        s = SUFFIX[side]
        foot = (f"ankle_{s}", f"heel_{s}", f"toe_{s}", f"ankle_{s}")
        chains.append((side, ("lumbar", f"hip_{s}", f"knee_{s}", *foot)))
    for owner, chain in chains:
        for a, b in pairwise(chain):
            lines.append(Shape("recorded", f"recorded {a}", f"recorded {b}", _LINE, side=owner))
    turn = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    dot = np.stack([np.cos(turn), _DOT * np.sin(turn)], axis=1)
    for name, path in frames.recorded.markers.items():
        points[f"marker {name}"] = path + eye
        points[f"marker {name} above"] = path + eye + [0.0, _DOT]
        dots.append(Shape("marker", f"marker {name}", f"marker {name} above", dot, closed=True))
    return lines, dots, points


def _muscles(
    points: Mapping[str, np.ndarray], joints: Sequence[str], suffix: str, side: Side | None
) -> tuple[Shape, ...]:
    """Return the muscles of some joints as lenses beside the segments."""
    shapes = []
    for name, (start, end, first, last, sign) in _MUSCLE_PLACES.items():
        if name.split("_")[0] in joints:
            bulge = np.sin(np.linspace(0.0, np.pi, 11)) ** 0.8
            along = np.linspace(first, last, 11)
            near = np.stack([along, np.full(11, sign * _MUSCLE_GAP)], axis=1)
            far = np.stack([along, sign * (_MUSCLE_GAP + _MUSCLE_WIDTH * bulge)], axis=1)
            lens = np.concatenate([near[[0, -1]], far[-2:0:-1]])
            which = GENERATORS.index(f"{name}{suffix}")
            shapes.append(
                Shape("muscle", f"{start}{suffix}", f"{end}{suffix}", lens, True, side, which)
            )
    return tuple(shapes)


def _foot(points: Mapping[str, np.ndarray], s: str) -> np.ndarray:
    """Return the triangle of heel, toe and ankle of a rigid foot."""
    heel, toe, ankle = (points[f"{name}_{s}"][0] for name in ("heel", "toe", "ankle"))
    sole, length = toe - heel, float(np.linalg.norm(toe - heel))
    left = np.array([-sole[1], sole[0]]) / length
    return np.array(
        [[0.0, 0.0], [1.0, 0.0], [(ankle - heel) @ sole / length**2, (ankle - heel) @ left]]
    )


def _shells() -> tuple[np.ndarray, np.ndarray]:
    """Return the shell around the shank, and that under the foot with its cup behind the heel."""
    top, bottom, depth = _SHELL
    shank = np.array([[top, depth], [bottom, depth], [bottom, -depth], [top, -depth]])
    rear, front, thickness, height = _SOLE
    inner = rear + 0.1
    return shank, np.array([[rear, 0.0], [front, 0.0], [front, thickness], [inner, thickness],
                     [inner, height], [rear, height]])  # fmt: skip


def _zigzag() -> np.ndarray:
    """Return a spring from end to end."""
    share = np.linspace(0.15, 0.85, 2 * _COILS)
    across = _COIL_WIDTH / 2 * np.where(np.arange(2 * _COILS) % 2, -1.0, 1.0)
    coils = np.stack([share, across], axis=1)
    return np.concatenate([[[0.0, 0.0], [0.1, 0.0]], coils, [[0.9, 0.0], [1.0, 0.0]]])


def _shank_of_shell(points: Mapping[str, np.ndarray], s: str) -> tuple[str, str]:
    """Return the points that a shell hangs on: its own, or those of the shank that carries it."""
    own = f"shell_knee_{s}" in points
    return (f"shell_knee_{s}", f"shell_ankle_{s}") if own else (f"knee_{s}", f"ankle_{s}")


def _spring_ends(points: Mapping[str, np.ndarray], sides: Sequence[Side]) -> dict[str, np.ndarray]:
    """Return where the springs hang on the shells, behind the ankles [m], shape (n, 2) each."""
    ends = {}
    top, foot = np.array([[_SHELL[1], -_SHELL[2]]]), np.array([[_SOLE[0], _SOLE[3]]])
    for s in (SUFFIX[side] for side in sides):
        above = ("top", top, *_shank_of_shell(points, s))
        for name, corner, start, end in (above, ("foot", foot, f"heel_{s}", f"toe_{s}")):
            pairs = zip(points[start], points[end], strict=True)
            ends[f"spring_{name}_{s}"] = np.array([_placed(corner, a, b)[0] for a, b in pairs])
    return ends


def _arrows(frames: GaitFrames, side: Side) -> np.ndarray:
    """Return the arrow of the ground force at the centre of pressure, shape (n, 7, 2)."""
    arrows = np.full((frames.count, 7, 2), np.nan)
    scale = force_scale(frames)
    for i, (x, force) in enumerate(zip(frames.pressure[side], frames.force[side], strict=True)):
        if np.isfinite(x):
            start = np.array([x, 0.0])
            length = float(np.linalg.norm(scale * force))
            neck = 1.0 - min(_HEAD_LENGTH / length, 0.6)
            half = np.array([[0.0, 0.5], [neck, 0.5]]) * [1.0, _SHAFT]
            barb = np.array([[neck, _HEAD_WIDTH / 2]])
            upper = np.concatenate([half, barb])
            outline = np.concatenate([upper, [[1.0, 0.0]], upper[::-1] * [1.0, -1.0]])
            arrows[i] = _placed(outline, start, start + scale * force)
    return arrows
