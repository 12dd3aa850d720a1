"""Broken content of files, made on the spot: YAML, tables, archives and JSON."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from typing import Final

import numpy as np

HTML: Final = "<script>alert(1)</script>"


def bomb(levels: int = 12, copies: int = 9) -> bytes:
    """Return YAML of few lines whose aliases stand for copies ** levels values."""
    lines = ["a0: &a0 [x]"]
    for level in range(1, levels):
        copied = ", ".join([f"*a{level - 1}"] * copies)
        lines.append(f"a{level}: &a{level} [{copied}]")
    return "\n".join(lines).encode()


YAML: Final[dict[str, bytes]] = {
    "empty": b"",
    "comment alone": b"# nothing\n",
    "byte order mark alone": b"\xef\xbb\xbf",
    "Latin-1": "id: Müller\n".encode("latin-1"),
    "UTF-16": "id: child\n".encode("utf-16"),
    "NUL byte": b"id: a\0b\n",
    "control character": b'id: "\x01"\n',
    "escaped NUL": b'id: "a\\0b"\npatient: "a\\0b"\nbase: "a\\0b"\northosis: "a\\0b"\n',
    "half a surrogate": b'id: "\\uD800"\n',
    "scalar": b"hello\n",
    "list": b"- 1\n- 2\n",
    "two documents": b"---\na: 1\n---\nb: 2\n",
    "tab": b"id:\n\tx: 1\n",
    "open quote": b'id: "child\n',
    "open bracket": b"id: [1, 2\n",
    "other version": b"%YAML 9.9\n---\na: 1\n",
    "repeated key": b"id: x\nid: y\n",
    "repeated inner key": b"mesh: {degree: 3, degree: 4}\n",
    "merge key": b"a: &a {b: 1}\nc: {<<: *a}\n",
    "unknown alias": b"id: *x\n",
    "alias of itself": b"a: &a [*a, *a]\n",
    "billion laughs": bomb(),
    "nested lists": b"id: " + b"[" * 60 + b"]" * 60,
    "deeply nested lists": b"id: " + b"[" * 400 + b"]" * 400,
    "nested mappings": b"{a: " * 300 + b"1" + b"}" * 300,
    "Python object": b'id: !!python/object/apply:os.system ["true"]\n',
    "binary": b"id: !!binary aGVsbG8=\n",
    "set": b"id: !!set {b, c}\n",
    "no whole number": b'id: !!int ""\n',
    "no float": b"id: !!float x\n",
    "no truth value": b"id: !!bool x\n",
    "no time": b"id: !!timestamp x\n",
    "number of 400 digits": b"age: 1" + b"0" * 400 + b"\nreference_height: 1" + b"0" * 400,
    "number of 6000 digits": b"age: 1" + b"0" * 6000,
    "beyond floats": b"age: 1e999\nreference_height: 1e999\n",
    "not a number": b"age: .nan\nreference_height: .nan\n",
    "list as key": b"? [1, 2]\n: 1\n",
    "empty key": b"~: 1\n",
    "line end in a key": b'"a\\nb": 1\n',
    "terminal codes": b'"\\e[2J": 1\n',
    "HTML as key": f'"{HTML}": 1\n'.encode(),
    "path that climbs": b"id: ../../x\nname: ../../x\n",
    "path too long": b"orthosis: " + b"a" * 5000 + b"\nbase: " + b"a" * 5000,
    "text of 100 kB": b"age: " + b"x" * 100_000,
    "50 MB": b"# padding\n" * 5_000_000,
}
"""Content that no YAML file of any kind may have."""

ANGLES: Final = (
    "time [s],pelvis_tx [m],pelvis_tz [m],pelvis_tilt [rad],hip_r [rad],knee_r [rad],"
    "ankle_r [rad],hip_l [rad],knee_l [rad],ankle_l [rad],lumbar [rad]"
)


def angles(frames: int = 30) -> str:
    """Return a table of angles that is in order."""
    rows = [",".join([f"{n / 100:g}", *["0.1"] * 10]) for n in range(frames)]
    return "\n".join([ANGLES, *rows]) + "\n"


def _with(row: int, column: int, cell: str) -> bytes:
    rows = [line.split(",") for line in angles().splitlines()]
    rows[row][column] = cell
    return "\n".join(",".join(cells) for cells in rows).encode()


TABLES: Final[dict[str, bytes]] = {
    "empty": b"",
    "header alone": ANGLES.encode(),
    "column missing": angles().replace(",lumbar [rad]", "").encode(),
    "columns in another order": angles()
    .replace("hip_r [rad],knee_r", "knee_r [rad],hip_r")
    .encode(),
    "degrees": angles().replace("hip_r [rad]", "hip_r [deg]").encode(),
    "column twice": angles().replace("hip_l", "hip_r").encode(),
    "no units": angles().replace(" [rad]", "").encode(),
    "semicolons": angles().replace(",", ";").encode(),
    "tabs": angles().replace(",", "\t").encode(),
    "decimal commas": angles().replace("0.1", '"0,1"').encode(),
    "NaN": _with(5, 3, "nan"),
    "infinity": _with(5, 3, "inf"),
    "text": _with(5, 3, "upright"),
    "empty cell": _with(5, 3, ""),
    "HTML in a cell": _with(5, 3, HTML),
    "cell of 200 kB": _with(5, 3, "9" * 200_000),
    "cell too many": _with(5, 3, "0.1,0.1"),
    "time goes back": _with(9, 0, "0.01"),
    "time stands": _with(2, 0, "0"),
    "too few rows": angles(5).encode(),
    "UTF-16": angles().encode("utf-16"),
    "Latin-1": angles().replace("lumbar", "rücken").encode("latin-1"),
    "NUL byte": _with(5, 3, "0\0"),
    "random bytes": bytes(range(256)) * 20,
}
"""Angles of a recording that cannot be used."""

EVENTS: Final[dict[str, bytes]] = {
    "empty": b"",
    "byte order mark": b"\xef\xbb\xbfside,event,frame,time [s]\nright,toe_off,3,0.03\n",
    "other header": b"side,event,frame\nright,toe_off,3\n",
    "unknown side": b"side,event,frame,time [s]\nmiddle,toe_off,3,0.03\n",
    "unknown event": b"side,event,frame,time [s]\nright,jump,3,0.03\n",
    "frame that is none": b"side,event,frame,time [s]\nright,toe_off,x,0.03\n",
    "frame below zero": b"side,event,frame,time [s]\nright,toe_off,-1,0.03\n",
    "frame after the end": b"side,event,frame,time [s]\nright,toe_off,30,0.3\n",
    "superscript frame": "side,event,frame,time [s]\nright,toe_off,²,0.03\n".encode(),
    "frame of 5000 digits": b"side,event,frame,time [s]\nright,toe_off," + b"9" * 5000 + b",0\n",
    "short row": b"side,event,frame,time [s]\nright\n",
    "Latin-1": "side,event,frame,time [s]\nright,toe_off,ä,0\n".encode("latin-1"),
}
"""Events of a recording of 30 frames that cannot be used."""


def archive(zeros: int = 0, **members: bytes) -> bytes:
    """Return a compressed archive with these members, the first with millions of zeros more."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as made:
        for name, content in members.items():
            with made.open(name.replace("__", "."), "w", force_zip64=True) as member:
                member.write(content)
                for _ in range(zeros):  # in parts: the memory of this process is measured
                    member.write(bytes(1_000_000))
    return file.getvalue()


def arrays(**content: object) -> bytes:
    """Return an archive of arrays; objects are pickled."""
    file = io.BytesIO()
    np.savez(file, **{name: np.asarray(value) for name, value in content.items()})
    return file.getvalue()


def _claimed(shape: str) -> bytes:
    """Return the header of an array of some shape, without its numbers."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()


ARCHIVES: Final[dict[str, bytes | Callable[[], bytes]]] = {
    "empty": b"",
    "text": b"a motion, but in words",
    "empty archive": archive(),
    "pickled objects": arrays(unknowns=[{"a": 1}, None], rows=[{"a": 1}], phases=[{}, 1]),
    "text for numbers": arrays(unknowns=["a"], rows=["b"], phases=["right_flat"], durations=["x"]),
    "no axes": arrays(unknowns=1.0, rows=1.0, phases=1.0),
    "not finite": arrays(unknowns=[np.nan], rows=[np.inf]),
    "member that is no array": archive(unknowns=b"words", rows=b"words", phases=b"words"),
    "8 TB claimed": archive(unknowns__npy=_claimed("(1000000000000,)"), rows__npy=b""),
    "shape beyond whole numbers": archive(unknowns__npy=_claimed("(10**9, 10**9, 10**9)")),
    "negative shape": archive(unknowns__npy=_claimed("(-5,)")),
    "header that calls": archive(unknowns__npy=_claimed("(__import__('os').getpid(),)")),
    "600 MB of zeros": lambda: archive(600, unknowns__npy=_claimed("(75000000,)")),
}
"""Archives that hold neither a motion nor multipliers, or what takes its time to make one."""

JSON: Final[dict[str, bytes]] = {
    "empty": b"",
    "text": b"status: converged",
    "list": b"[]",
    "number": b"1",
    "other keys": b"{}",
    "cut off": b'{"run_format": 1, "problem": "mapd',
    "Latin-1": '{"problem": "ä"}'.encode("latin-1"),
    "NaN": b'{"run_format": NaN}',
    "number of 400 digits": b'{"run_format": 1' + b"0" * 400 + b"}",
    "number of 6000 digits": b'{"run_format": 1' + b"0" * 6000 + b"}",
    "deeply nested": b"[" * 100_000,
    "NUL byte": b"\0",
}
"""Metrics that cannot be used."""
