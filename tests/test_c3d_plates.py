"""Force plates of every type against ezc3d's own reader, and what it gets wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pathwalker_cli.io.c3d import Recording, read_c3d
from pathwalker_cli.io.c3d_plates import centre_of_pressure, plate_axes

ezc3d = pytest.importorskip("ezc3d")

CORNERS = np.array([[0.6, 0.9, 0.0], [0.2, 0.9, 0.0], [0.2, 0.3, 0.0], [0.6, 0.3, 0.0]])
FRAMES, PER_FRAME = 30, 4
COUNTS = {1: 6, 2: 6, 3: 8, 4: 6, 5: 8, 6: 12, 7: 8, 21: 6}


def channels(kind: int) -> np.ndarray:
    """Return made channels of a plate, shape (samples, channels)."""
    made = np.random.default_rng(kind).normal(0.0, 30.0, (FRAMES * PER_FRAME, COUNTS[kind]))
    made[:, 4 if COUNTS[kind] > 6 else 2 :] += 150.0
    return made


def written(
    path: Path, kind: int, values: np.ndarray, matrix: np.ndarray | None = None, **other: Any
) -> Path:
    """Write a C3D file with one plate, numbers of plates as whole numbers."""
    file = ezc3d.c3d()
    points = np.ones((4, 1, FRAMES))
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A"]
    file["data"]["points"] = points
    count = values.shape[1]
    file["parameters"]["ANALOG"]["RATE"]["value"] = [100.0 * PER_FRAME]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = [f"C{i}" for i in range(count)]
    file["parameters"]["ANALOG"]["UNITS"]["value"] = other.pop("units", ["V"] * count)
    file["data"]["analogs"] = values.T[None]
    group = {
        "USED": [1],
        "TYPE": [kind],
        "CORNERS": (CORNERS.T * 1e3)[..., None],
        "ORIGIN": np.array([[150.0], [200.0], [-30.0]]),
        "CHANNEL": (np.arange(count) + 1)[:, None],
        "CAL_MATRIX": np.zeros((6, 6, 1)) if matrix is None else matrix[..., None],
        **other,
    }
    for name, value in group.items():
        file.add_parameter("FORCE_PLATFORM", name, np.asarray(value, dtype=float))
    file.write(str(path))
    path.write_bytes(_whole_numbers(path.read_bytes()))
    return path


def _whole_numbers(data: bytes) -> bytes:
    """Return a file whose plates count in whole numbers, as the library's own reader wants them."""
    first = (int.from_bytes(data[16:18], "little") - 1) * 512
    for name in (b"USED", b"TYPE", b"CHANNEL"):
        kind = data.index(b"TYPE")
        at = data.rindex(b"USED", 0, kind) if name == b"USED" else data.index(name, kind)
        head = at + len(name)  # distance of the next parameter, type, dimensions, values
        start = head + 4 + data[head + 3]
        count = int(np.prod(np.frombuffer(data[head + 4 : start], dtype=np.uint8), dtype=int))
        values = np.frombuffer(data[start : start + 4 * count], dtype="<f4").astype("<i2").tobytes()
        length = int.from_bytes(data[head : head + 2], "little") - 2 * count
        new = data[:head] + length.to_bytes(2, "little") + b"\x02" + data[head + 3 : start] + values
        data = new + data[start + 4 * count : first] + bytes(2 * count) + data[first:]
    return data


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_forces_are_those_of_the_library(kind: int, tmp_path: Path) -> None:
    matrix = np.arange(36.0).reshape(6, 6) * 0.01 + np.eye(6) if kind == 4 else None
    path = written(tmp_path / "plate.c3d", kind, channels(kind), matrix)
    (plate,) = read_c3d(path).plates
    (library,) = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
    assert plate.force == pytest.approx(library["force"].T, abs=1e-6)
    point = centre_of_pressure(plate, -np.inf)
    expected = library["center_of_pressure"].T * 1e-3
    assert point[:, :2] == pytest.approx(expected[:, :2], abs=1e-6)
    if kind > 1:  # the library gives the moment of type 1 the other sign
        assert plate.moment == pytest.approx(library["moment"].T * 1e-3, abs=1e-6)


@pytest.mark.parametrize(("kind", "shape"), [(5, (6, 8)), (7, (8, 8))])
def test_calibrated_plates_multiply_their_channels(
    kind: int, shape: tuple[int, int], tmp_path: Path
) -> None:
    matrix = np.random.default_rng(1).normal(size=shape) + 2.0 * np.eye(*shape)
    values = channels(kind)
    (plate,) = read_c3d(written(tmp_path / "a.c3d", kind, values, matrix)).plates
    plain, six = (3, values @ matrix.T) if kind == 7 else (2, values @ matrix.T)
    origin = np.array([[150.0], [200.0], [-30.0]] if kind == 7 else [[0.0], [0.0], [-30.0]])
    (other,) = read_c3d(written(tmp_path / "b.c3d", plain, six, ORIGIN=origin)).plates
    assert plate.force == pytest.approx(other.force, abs=1e-3)
    assert plate.moment == pytest.approx(other.moment, abs=1e-3)


def test_twelve_channels_hold_the_three_forces_of_every_corner(tmp_path: Path) -> None:
    """Forces and their moments about the centre of the surface, corner by corner."""
    values, matrix = channels(6), np.random.default_rng(1).normal(size=(12, 12))
    (plate,) = read_c3d(written(tmp_path / "a.c3d", 6, values, matrix)).plates
    corners = np.array([[0.15, 0.2], [-0.15, 0.2], [-0.15, -0.2], [0.15, -0.2]])
    levers = np.column_stack([corners, np.full(4, 0.03)])  # ORIGIN goes from sensors to surface
    forces = (values @ matrix.T).reshape(-1, 4, 3)
    axes = plate_axes(CORNERS)
    assert plate.force == pytest.approx(forces.sum(axis=1) @ axes, abs=1e-3)
    moment = np.cross(levers, forces).sum(axis=1)
    assert plate.moment == pytest.approx(moment @ axes, abs=1e-3)


def test_sensors_stored_above_the_surface_are_below_it(tmp_path: Path) -> None:
    """The library turns the sensors' distances round with the depth, and the moments with them."""
    up = np.array([[150.0], [200.0], [30.0]])
    (plate,) = read_c3d(written(tmp_path / "a.c3d", 3, channels(3))).plates
    (other,) = read_c3d(written(tmp_path / "b.c3d", 3, channels(3), ORIGIN=up)).plates
    assert other.moment == pytest.approx(plate.moment)


def test_moments_in_their_own_unit(tmp_path: Path) -> None:
    units = ["N", "N", "N", "Nm", "Nm", "Nm"]
    (plate,) = read_c3d(written(tmp_path / "a.c3d", 2, channels(2))).plates
    values = channels(2) * ([1.0] * 3 + [1e-3] * 3)
    (other,) = read_c3d(written(tmp_path / "b.c3d", 2, values, units=units)).plates
    assert other.moment == pytest.approx(plate.moment, abs=1e-4)


@pytest.mark.parametrize(
    ("kind", "other", "words"),
    [
        (21, {}, "it is of type 21; allowed: types 1, 2, 3, 4, 5, 6, 7"),
        (6, {}, "it has no CAL_MATRIX of 12 x 12"),
        (7, {}, "it has no CAL_MATRIX of 8 x 8"),
        (2, {"CHANNEL": np.array([[1], [2], [3], [4], [5], [60]])}, "names channels that are not"),
        (2, {"CORNERS": np.zeros((3, 4, 0))}, "lacks channels, corners or origin"),
    ],
)
def test_a_plate_that_cannot_be_read_is_left_out(
    kind: int, other: dict[str, np.ndarray], words: str, tmp_path: Path
) -> None:
    recording: Recording = read_c3d(written(tmp_path / "a.c3d", kind, channels(kind), **other))
    assert recording.plates == ()
    assert len(recording.remarks) == 1
    assert words in recording.remarks[0]
