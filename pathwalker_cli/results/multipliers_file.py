"""The multipliers of a run as `multipliers.npz`, so that neighbouring problems start warm."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.nlp.ipopt import Multipliers
from pathwalker_cli.results.motion_file import read_arrays

__all__ = ["read_multipliers", "write_multipliers"]


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
        raise DataError("holds no multipliers", where=str(path), mend="solve again")
    if not all(np.isfinite(k).all() for k in found if k is not None):
        raise DataError("holds values that are not finite", where=str(path), mend="solve again")
    return Multipliers(arrays["unknowns"], arrays["rows"])
