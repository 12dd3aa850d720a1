"""OpenSim's tables as another program reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pathwalker_cli.trajectory import Trajectory


def read_opensim(path: Path) -> Trajectory:
    """Read a .mot or .sto; its units are not known."""
    lines = path.read_text(encoding="utf-8").splitlines()
    end = lines.index("endheader")
    facts = dict(line.split("=") for line in lines[1:end])
    names = lines[end + 1].split("\t")
    values = np.loadtxt(lines[end + 2 :], delimiter="\t", ndmin=2)
    assert facts["inDegrees"] == "no"
    assert (
        values.shape == (int(facts["nRows"]), int(facts["nColumns"])) == (len(values), len(names))
    )
    return Trajectory(values[:, 0], tuple(names[1:]), values[:, 1:], ("",) * (len(names) - 1))
