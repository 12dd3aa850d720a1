"""The exact motion and the multipliers of a run, so that another solve can begin with them."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GENERATORS
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.costs import Costs
from pathwalker_cli.io.atomic import refuse_special
from pathwalker_cli.model.contact import PHASE_NAMES, phase_named
from pathwalker_cli.model.skeleton import EVERY_JOINT
from pathwalker_cli.nlp.result import Multipliers
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion

_ARRAYS: Final = (
    "mesh", "states", "smooth", "controls", "integrals", "inner_states", "algebraic"
)  # fmt: skip
_AGAIN: Final = "solve again"
_MOST_BYTES: Final = 500_000_000
"""Size of all arrays of a file together; those of a fine mesh take some 10 MB."""
_DAMAGED: Final = (
    OSError, EOFError, ValueError, TypeError, LookupError, ArithmeticError, MemoryError,
    RuntimeError, SyntaxError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What NumPy and its unzipping raise at damaged headers, sizes and contents."""


def write_motion(path: str | Path, motion: PhasedMotion) -> None:
    """Write a motion: arrays `<phase>.<name>`, `durations`, `parameters` and `phases`."""
    arrays = {
        f"{phase.name}.{name}": getattr(phase, name) for phase in motion.phases for name in _ARRAYS
    }
    names = np.array([phase.name for phase in motion.phases])
    with Path(path).open("wb") as file:
        np.savez(
            file,
            allow_pickle=False,
            phases=names,
            durations=motion.durations,
            parameters=motion.parameters,
            **arrays,
        )


def read_motion(path: str | Path) -> PhasedMotion:
    """Read a motion.

    Raises:
        DataError: If the file is missing, damaged or no motion of a gait problem.
    """
    arrays = read_arrays(Path(path))
    try:
        names = tuple(str(name) for name in arrays["phases"])
        if not names or not set(names) <= set(PHASE_NAMES):
            known = f"a stride of {', '.join(PHASE_NAMES)}"
            raise DataError("holds other phases", where=str(path), allowed=known)
        durations, parameters = (_floats(arrays[key]) for key in ("durations", "parameters"))
        positive = np.isfinite(durations) & (durations > 0.0)
        if durations.shape != (len(names),) or not positive.all():
            raise DataError("holds phase durations that are not positive", where=str(path))
        phases = tuple(
            PhaseMotion(name, float(duration), **{k: arrays[f"{name}.{k}"] for k in _ARRAYS})
            for name, duration in zip(names, durations, strict=True)
        )
        motion = PhasedMotion(phases, parameters)
    except KeyError as missing:
        raise DataError(f"lacks {missing}", where=str(path), mend=_AGAIN) from None
    except (TypeError, ValueError) as problem:
        raise DataError(f"holds no numbers: {problem}", where=str(path), mend=_AGAIN) from None
    _check(motion, path)
    return motion


def write_multipliers(path: str | Path, multipliers: Multipliers) -> None:
    """Write the multipliers of the bounds on the unknowns and of the rows."""
    with Path(path).open("wb") as file:
        np.savez(file, unknowns=multipliers.unknowns, rows=multipliers.rows, allow_pickle=False)


def read_multipliers(path: str | Path) -> Multipliers:
    """Read multipliers.

    Raises:
        DataError: If the file is missing, damaged or holds something else.
    """
    arrays = read_arrays(Path(path))
    found = [arrays.get(name) for name in ("unknowns", "rows")]
    if any(k is None or k.ndim != 1 or k.dtype.kind != "f" for k in found):
        raise DataError("holds no multipliers", where=str(path), mend=_AGAIN)
    if not all(np.isfinite(k).all() for k in found if k is not None):
        raise DataError("holds values that are not finite", where=str(path), mend=_AGAIN)
    return Multipliers(arrays["unknowns"], arrays["rows"])


def read_arrays(path: Path) -> Mapping[str, np.ndarray]:
    """Return all arrays of an `.npz` file of a run.

    Raises:
        DataError: If the file is missing or damaged.
    """
    refuse_special(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise DataError("is a single array", where=str(path), allowed="a motion of a run")
            with zipfile.ZipFile(path) as archive:
                unpacked = sum(member.file_size for member in archive.infolist())
            if unpacked > _MOST_BYTES:
                what = f"holds more than {_MOST_BYTES // 1_000_000} MB"
                raise DataError(what, where=str(path), mend=_AGAIN)
            arrays = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise DataError("no such file", where=str(path), mend=_AGAIN) from None
    except _DAMAGED:
        raise DataError("is damaged or no file of a run", where=str(path), mend=_AGAIN) from None
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise DataError("holds something else than arrays", where=str(path), mend=_AGAIN)
    return arrays


def _floats(values: np.ndarray) -> np.ndarray:
    """Return an array of floating point numbers."""
    if values.dtype.kind != "f":
        raise TypeError(f"an array of type {values.dtype}")
    return values


def _check(motion: PhasedMotion, path: str | Path) -> None:
    """Refuse shapes that do not belong to the gait problem, and values that are not finite."""
    if motion.parameters.ndim != 1 or not np.isfinite(motion.parameters).all():
        raise DataError("holds parameters that are no numbers", where=str(path), mend=_AGAIN)
    for phase in motion.phases:
        expected = _shapes(phase)
        for name in _ARRAYS:
            values = getattr(phase, name)
            place = f"{path}, {phase.name}.{name}"
            if values.shape != expected[name]:
                what = f"has shape {values.shape}"
                raise DataError(what, where=place, allowed=str(expected[name]), mend=_AGAIN)
            if values.dtype.kind != "f" or not np.isfinite(values).all():
                raise DataError("holds values that are not finite", where=place, mend=_AGAIN)
        ends = phase.mesh[0] == 0.0 and np.isclose(phase.mesh[-1], 1.0)
        if not ends or not (np.diff(phase.mesh) > 0.0).all():
            place = f"{path}, {phase.name}.mesh"
            raise DataError("does not increase from 0 to 1", where=place, mend=_AGAIN)


def _shapes(phase: PhaseMotion) -> dict[str, tuple[int, ...]]:
    """Return the shapes that belong to the mesh and the degree of a phase."""
    contact, nodes = phase_named(phase.name), max(2, phase.mesh.size)
    n = phase.states.shape[-1] // 2 if phase.states.ndim else 0
    n = n if len(COORDINATES) < n <= EVERY_JOINT.size else len(COORDINATES)
    if phase.algebraic.shape[-1:] == (2 * n + len(contact.with_toes.forces),):
        contact = contact.with_toes
    inner = phase.inner_states.shape
    degree = inner[1] if len(inner) == 3 else 1
    width = phase.integrals.shape[-1] if phase.integrals.ndim else 0
    costs = max(width, len(Costs().integrals))  # goals and fits add some
    return {
        "mesh": (nodes,),
        "states": (nodes, 2 * n),
        "smooth": (nodes, len(GENERATORS)),
        "controls": (nodes, len(GENERATORS)),
        "integrals": (nodes, costs),
        "inner_states": (nodes - 1, degree, 2 * n),
        "algebraic": (nodes - 1, degree, 2 * n + len(contact.forces)),
    }
