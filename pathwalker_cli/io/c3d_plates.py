"""Force plates of a C3D file: force and moment from the channels of every common type.

The formulas are those of ezc3d's own reader, which refuses too much of what laboratories write
(counts stored as floats, one unknown plate among known ones) and reads unsigned offsets wrongly.

References:
    The C3D file format, user guide (Motion Lab Systems): FORCE_PLATFORM, types 1 to 4.
    Visual3D documentation (HAS-Motion), FP_TYPE: channels and matrices of types 1 to 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d_events import continued

METRES: Final = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Length of the units of C3D files [m]."""

LOADED: Final = 20.0
"""Vertical force from which a plate counts as loaded [N]; about ten times its noise."""

CHANNELS: Final = {1: 6, 2: 6, 3: 8, 4: 6, 5: 8, 6: 12, 7: 8}
"""Channels of the types that are read."""

_ROWS: Final = {4: 6, 5: 6, 6: 12, 7: 8}
"""Rows of the matrix that the channels of a type are multiplied with."""


@dataclass(frozen=True)
class ForcePlate:
    """A force plate and what it measured.

    Args:
        name: Name for messages, "plate 1".
        corners: Corners 1 to 4 in the laboratory [m], shape (4, 3).
        force: Ground reaction force on the body [N], laboratory axes, shape (samples, 3).
        moment: Moment about the centre of the surface [N m], laboratory axes, shape (samples, 3).
        origin: From the sensors' level to that centre [m], laboratory axes, shape (3,).
    """

    name: str
    corners: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def centre(self) -> np.ndarray:
        """Centre of the surface in the laboratory [m], shape (3,)."""
        return np.asarray(self.corners.mean(axis=0))


def plate_axes(corners: np.ndarray) -> np.ndarray:
    """Return a plate's unit axes in the laboratory, one a row; NaN without extent."""
    x = corners[0] - corners[1]
    z = np.cross(x, corners[0] - corners[3])
    y = np.cross(z, x)
    with np.errstate(invalid="ignore"):
        return np.stack([axis / np.linalg.norm(axis) for axis in (x, y, z)])


def centre_of_pressure(load: ForcePlate, least_force: float) -> np.ndarray:
    """Return where the force's line of action meets the plate's surface [m], shape (samples, 3).

    Without a moment about a horizontal axis at the surface; NaN where the vertical force is below
    `least_force` [N].
    """
    fz = load.force[:, 2]
    mx, my, _ = load.moment.T
    with np.errstate(divide="ignore", invalid="ignore"):
        point = np.stack([-my / fz, mx / fz, np.zeros_like(fz)], axis=-1) + load.centre
    point[fz < least_force] = np.nan
    return point


def read_plates(content: Any, unit: float) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """Return the plates that can be read, and a sentence about every other one.

    Content is ezc3d's view of the file; the unit is its unit of length [m].
    """
    group = content["parameters"].get("FORCE_PLATFORM", {})
    used = np.atleast_1d(group["USED"]["value"]) if "USED" in group else np.zeros(1)
    if not used.size or not int(used[0]) or not content["data"]["analogs"].size:
        return (), ()
    analog, plates, remarks = analog_channels(content), [], []
    units = [str(text) for text in continued(content["parameters"]["ANALOG"], "UNITS")]
    for index in range(int(used[0])):
        name = f"plate {index + 1}"
        kinds = np.atleast_1d(group["TYPE"]["value"])
        kind = int(kinds[index]) if index < kinds.size else 0
        try:
            plates.append(_plate(name, kind, _parameters(group, index), analog, units, unit))
        except DataError as problem:
            remarks.append(f"{name} is left out: it {problem}")
        except (LookupError, ValueError):
            remarks.append(f"{name} is left out: it lacks channels, corners or origin")
    return tuple(plates), tuple(remarks)


def _parameters(group: Mapping[str, Any], index: int) -> dict[str, np.ndarray]:
    """Return a plate's corners (4, 3), origin (3,), channels (c,) and calibration (rows, c)."""
    values = {
        name: np.asarray(group[name]["value"], dtype=float)[..., index]
        for name in ("CORNERS", "ORIGIN", "CHANNEL")
    }
    matrices = np.asarray(group.get("CAL_MATRIX", {"value": ()})["value"], dtype=float)
    if matrices.ndim == 3 and index < matrices.shape[2]:
        values["CAL_MATRIX"] = matrices[..., index]
    return values


def _plate(
    name: str,
    kind: int,
    values: Mapping[str, np.ndarray],
    analog: np.ndarray,
    units: Sequence[str],
    unit: float,
) -> ForcePlate:
    """Return one plate from its parameters, all channels (samples, channels) and their units."""
    if kind not in CHANNELS:
        raise DataError(f"is of type {kind}", allowed=f"types {', '.join(map(str, CHANNELS))}")
    count = CHANNELS[kind]
    columns = values["CHANNEL"][:count].astype(int) - 1
    if columns.size < count or columns.min() < 0 or columns.max() >= analog.shape[1]:
        raise DataError(f"names channels that are not there, and type {kind} has {count}")
    channels, lengths = analog[:, columns], unit
    if kind in _ROWS:
        matrix = values.get("CAL_MATRIX", np.zeros((0, 0)))[: _ROWS[kind], :count]
        if matrix.shape != (_ROWS[kind], count):
            raise DataError(f"has no CAL_MATRIX of {_ROWS[kind]} x {count}")
        channels = channels @ matrix.T
    elif columns[-1] < len(units):  # moments have a unit of their own, or the file's
        own = units[columns[-1]].lower().strip().removeprefix("n").strip(" .*-")
        lengths = METRES.get(own, unit)
    corners, origin = values["CORNERS"].T * unit, values["ORIGIN"] * unit
    if origin[2] > 0.0:  # in files of some programs the sensors seem to lie above the surface
        origin = -origin
    sensors = np.abs(origin[:2])  # where types 3, 6 and 7 keep how far they stand from the centre
    if kind not in (2, 4):
        origin = origin * [0.0, 0.0, 1.0]
    axes = plate_axes(corners)
    if kind == 1:  # centre of pressure and free moment in place of moments
        force, point = channels[:, :3], channels[:, 3:6] * [unit, unit, 0.0]
        moment = np.cross(point, force)
        moment[:, 2] += channels[:, 5] * lengths
    else:
        if kind in (3, 6, 7):
            channels, lengths = _wrench_of_corners(channels, *sensors), 1.0
        force = channels[:, :3]
        moment = channels[:, 3:6] * lengths + np.cross(force, origin)
    return ForcePlate(name, corners, force @ axes, moment @ axes, origin @ axes)


def _wrench_of_corners(channels: np.ndarray, a: float, b: float) -> np.ndarray:
    """Return force and moment of a plate with sensors at its corners, shape (samples, 6).

    Args:
        channels: x12, x34, y14, y23, z1, z2, z3, z4, or x, y, z of every corner in turn [N], shape
            (samples, 8) or (samples, 12).
        a: Distance of the sensors from the centre along the plate's x [m].
        b: The same along y [m].
    """
    if channels.shape[1] == 12:
        x1, y1, z1, x2, y2, z2, x3, y3, z3, x4, y4, z4 = channels.T
        x12, x34, y14, y23 = x1 + x2, x3 + x4, y1 + y4, y2 + y3
    else:
        x12, x34, y14, y23, z1, z2, z3, z4 = channels.T
    return np.column_stack([
        x12 + x34, y14 + y23, z1 + z2 + z3 + z4,
        b * (z1 + z2 - z3 - z4), a * (-z1 + z2 + z3 - z4), b * (-x12 + x34) + a * (y14 - y23),
    ])  # fmt: skip


def analog_offset_error(offset: np.ndarray, scale: np.ndarray, unsigned: bool) -> np.ndarray:
    """Return what ezc3d adds to every channel by misreading ANALOG:OFFSET, shape of `offset`.

    The parameter is a 16-bit word.  In a file of unsigned samples, an offset above 32767 reads as
    a negative number; ezc3d 1.7 then takes its absolute value instead of adding 65536.

    Args:
        offset: ANALOG:OFFSET as read [counts].
        scale: Physical units per count.
        unsigned: Whether ANALOG:FORMAT is UNSIGNED.
    """
    true = np.mod(offset, 65536) if unsigned else offset
    return (true - np.abs(offset)) * scale


def analog_channels(content: Any) -> np.ndarray:
    """Return the analog channels in physical units, shape (samples, channels)."""
    group = content["parameters"]["ANALOG"]
    channels = np.array(content["data"]["analogs"][0].T, dtype=float)
    offset, scale = (
        np.asarray(continued(group, name), dtype=float)[: channels.shape[1]]
        for name in ("OFFSET", "SCALE")
    )
    scale = scale * float(group["GEN_SCALE"]["value"][0])
    form = group["FORMAT"]["value"] if "FORMAT" in group else []
    unsigned = bool(form) and str(form[0]).strip().upper() == "UNSIGNED"
    return channels - analog_offset_error(offset, scale, unsigned)
