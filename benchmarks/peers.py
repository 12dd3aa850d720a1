"""PathWalker beside its peers, one planar predictive step each: as in docs/performance.md.

python benchmarks/peers.py [--intervals N] [--iterations N]

Peers are installed into an environment of their own, so that nothing of them gets into ours; a
peer whose package cannot be had is a sentence.  OpenSim Moco gets the same child as a model (see
docs/opensim.md) and the same synthetic gait to begin with; actuators and contact are its own.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
import venv
from functools import partial
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np
from context import Context, metrics_of
from measure import HERE, PartFailedError, command, pathwalker
from report import Cell, Table
from rich.console import Console

from pathwalker_cli.case import load_case
from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.export.osim import joint_path, osim_text
from pathwalker_cli.export.xml import numbers, place
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.opensim import write_opensim
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.trajectory import Trajectory

PROBLEM: Final = "mapd-healthy"
"""One step and its mirror image, as predictive examples of Moco have it."""
CHANGES: Final = ("model.feet=rockers", "start.gait=synthetic")
"""What Moco's model and start have of the shipped config: circles on which it can stand."""
TOLERANCES: Final = {"convergence_tolerance": 1e-3, "constraint_tolerance": 1e-4}
"""Of Moco's solver."""
COLUMNS: Final = (
    "program", "status", "unknowns", "iterations", "CPU s of the process", "step [s]",
    "re-integration error [m, rad]", "[m/s, rad/s]",
)  # fmt: skip
NOTES: Final = (
    "The same child, speed, joint ranges and start; least effort per distance. PathWalker: rigid "
    "contact in phases, torque generators that depend on angle and speed, two meshes and their "
    "refinement, tables and figures. Moco: spheres on a compliant floor, torques with a "
    "first-order activation, one mesh.",
    "Error: from every mesh node to the next one, integrated anew with the controls found.",
)


def main() -> None:
    """Solve with every program that can be had, and print the table."""
    options = _options()
    with tempfile.TemporaryDirectory(prefix="pathwalker-peers-") as folder:
        context = Context(Path(folder), False, 1, print)
        table = Table("One planar predictive step", COLUMNS, NOTES)
        table.add(["PathWalker, from the same start"], partial(_ours, context, "synthetic"))
        table.add(["PathWalker, as shipped"], partial(_ours, context, "typical"))
        table.add(["OpenSim Moco"], partial(_moco, options, context.folder))
        table.print(Console(width=None if sys.stdout.isatty() else 190))
        print(table.markdown())
        print(_bioptim(context.folder))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--intervals", type=int, default=25, help="of Moco's mesh; 25")
    parser.add_argument("--iterations", type=int, default=300, help="of Moco, at most; 300")
    return parser.parse_args()


def _ours(context: Context, start: str) -> list[Cell]:
    """Return the row of `pathwalker solve` from such a start, nothing cached."""
    run, change = context.empty(start) / "run", f"start.gait={start}"
    words = ("solve", PROBLEM, PROBLEM, "--quiet", "--set", change, "--out", run)
    finished, found = pathwalker(*words, cache=context.empty("cache")), metrics_of(run)
    return [
        found["status"],
        found["stages"][-1]["unknowns"],
        found["iterations"],
        finished.cost.cpu,
        found["stride_time"] / 2.0,
        found["reintegration_position_error"],
        found["reintegration_velocity_error"],
    ]


def _moco(options: argparse.Namespace, folder: Path) -> list[Cell]:
    """Return the row of Moco."""
    python, step = _environment(folder, "opensim"), folder / "moco"
    step.mkdir()
    write_step(step, options)
    finished = command([python, HERE / "parts" / "moco.py", step])
    found = json.loads((step / "result.json").read_text(encoding="utf-8"))
    (unknowns,) = re.findall(r"Total number of variables\.*: +(\d+)", finished.output)
    return [
        found["status"],
        int(unknowns),
        found["iterations"],
        finished.cost.cpu - found["seconds_reintegration"],
        found["step_time"],
        found["position_error"],
        found["velocity_error"],
    ]


def _environment(folder: Path, package: str) -> Path:
    """Return the Python of a new environment that has this package.

    Raises:
        PartFailedError: If pip cannot install it.
    """
    home = folder / f"{package}-environment"
    venv.create(home, with_pip=True)
    python = home / "bin" / "python"
    try:
        command([python, "-m", "pip", "install", "--quiet", package])
    except PartFailedError as failure:
        raise PartFailedError(f"pip cannot install {package} here: {failure}") from None
    return python


def write_step(folder: Path, options: argparse.Namespace) -> None:
    """Write what `parts/moco.py` takes: our walker on round feet, our start, our bounds."""
    solver = GaitSolver(load_case(PROBLEM, changes=CHANGES))
    (folder / "model.osim").write_text(_lean(solver.walker), encoding="utf-8")
    stride, names = solver.stride.trajectory, map(joint_path, COORDINATES)
    time = np.linspace(0.0, stride.duration / 2.0, 101)
    values = np.hstack([stride.at(time), stride.rates_at(time)])
    paths = [f"{path}/{{}}" for path in names]
    columns = tuple(path.format(what) for what in ("value", "speed") for path in paths)
    guess = Trajectory(time, columns, values, ("",) * len(columns))
    write_opensim(folder / "guess.sto", guess, 12)
    bounds = solver.bounds.table.entries
    ranges = {name: bounds[(name,)] for name in COORDINATES if (name,) in bounds}
    ranges |= {"pelvis_tx": (0.0, 2.0), "pelvis_tz": (0.0, 2.0)}
    problem = {
        "intervals": options.intervals,
        "iterations": options.iterations,
        "tolerances": TOLERANCES,
        "time": (0.5 * time[-1], 2.0 * time[-1]),
        "speed": bounds[("walking_speed",)][0],
        "ranges": ranges,
    }
    (folder / "problem.json").write_text(json.dumps(problem), encoding="utf-8")


def _lean(walker: Walker) -> str:
    """Return the model with head and arms as a part of the trunk: a third less to compute."""
    document = ElementTree.fromstring(osim_text(walker))  # noqa: S314 - our own text
    bodies, joints = (document.find(f"Model/{name}Set/objects") for name in ("Body", "Joint"))
    for weld in joints.findall("WeldJoint"):
        joints.remove(weld)
        name = weld.findtext("socket_child_frame").rpartition("/")[2]
        bodies.remove(bodies.find(f"Body[@name='{name}']"))
    whole = walker.model.inertias[walker.model.getJointId("lumbar")]
    xx, yy, zz = np.diag(whole.inertia)
    trunk = bodies.find("Body[@name='trunk']")
    trunk.find("mass").text = numbers(whole.mass)
    trunk.find("mass_center").text = numbers(*place(whole.lever))
    trunk.find("inertia").text = numbers(xx, zz, yy, 0.0, 0.0, 0.0)
    return ElementTree.tostring(document, "unicode")


def _bioptim(folder: Path) -> str:
    """Return a sentence about bioptim: nothing was ever solved with it here."""
    try:
        _environment(folder, "bioptim")
    except PartFailedError as failure:
        return f"bioptim is left out: {failure}"
    return "bioptim can be had, but nobody has written this step for it"


if __name__ == "__main__":
    main()
