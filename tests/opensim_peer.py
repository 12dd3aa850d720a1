"""OpenSim: its tables as another program reads them, and what it says of an exported run."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pathwalker_cli.trajectory import Trajectory

PAGE = Path(__file__).parents[1] / "docs" / "opensim.md"
with_opensim = pytest.mark.skipif(
    find_spec("opensim") is None,
    reason="OpenSim is not installed: it has no package for this machine or Python",
)


def opensim_says(folder: Path) -> dict[str, Any]:
    """Run the script of the page on an exported folder."""
    (script,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    words = [sys.executable, "-c", script, folder.name]
    done = subprocess.run(words, cwd=folder.parent, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


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
