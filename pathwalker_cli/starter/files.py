"""The files of a new folder, from templates and the models that validate them."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment
from pydantic import BaseModel

from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import DataError, PatientError
from pathwalker_cli.io.atomic import staged_folder
from pathwalker_cli.io.fields import described, field_at
from pathwalker_cli.io.templates import templates
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.patient.blocks import OrthosisData
from pathwalker_cli.patient.proportions import ANKLE_HEIGHT, HEEL_SHARE, TOE_SHARE, default_length
from pathwalker_cli.starter.child import Child
from pathwalker_cli.starter.configs import WIDTH, comment, commented, config_files, unbroken
from pathwalker_cli.starter.seen import Seen

_LENGTHS: Final = {
    "pelvis": "Length of the pelvis segment.",
    "hip_drop": "How far the hip joints lie below the pelvis origin.",
    "lumbar_height": "How far the lumbar joint lies above the pelvis origin.",
    "trunk": "Lumbar joint to chin.",
    "head": "Chin to vertex.",
    "shoulder_height": "How far the shoulders lie above the lumbar joint.",
    "upper_arm": "Shoulder to elbow.",
    "lower_arm": "Elbow to wrist.",
    "hand": "Wrist to fingertips.",
}
"""Lengths that need no measuring, and what they are."""

_SOLE: Final = {"heel": (-0.0432, -0.084), "toe": (0.108, -0.06)}
"""Sole of the shoe of the shipped patient, in body heights."""

EXAMPLE_NOTE: Final = (
    "The C3D files are made, not recorded: joint angles and ground forces that were recorded of "
    "another child (the patient that comes with PathWalker), played by the model of the made-up "
    "child of this folder, with 1 mm of noise on every marker. They show the way from C3D files "
    "to springs and say nothing about anybody."
)


@dataclass(frozen=True)
class Step:
    """One thing to do within a folder: what it is for, in a sentence, and the commands."""

    why: str
    commands: tuple[str, ...] = ()


def folder_files(child: Child, seen: Seen, example: bool, walks: bool = False) -> dict[str, str]:
    """Return the texts of a new folder by file name.

    `example` says whether made recordings come with it, `walks` whether recorded barefoot walks do.
    """
    with_orthosis = seen.with_orthosis
    files = {"patient.yaml": _patient(child, seen, {})}
    purposes = {"patient.yaml": "the child: begin here"}
    if with_orthosis:
        files["orthosis.yaml"] = _orthosis({})
        purposes["orthosis.yaml"] = "the orthosis and its springs"
    for file in config_files(seen, _is_recorded(seen, walks)):
        files[file.name] = _environment().get_template("config.yaml.j2").render(file=file)
        purposes[file.name] = file.purpose[0].lower() + file.purpose[1:].split(". ")[0].rstrip(".")
    if example:
        purposes["c3d/"] = "made recordings"
    readme = _environment().get_template("README.txt.j2")
    if walks:
        purposes["c3d/"] = "recordings"
    steps = next_steps(seen, example, walks)
    shown = {
        name: textwrap.fill(text, WIDTH - 26).replace("\n", "\n" + " " * 26)
        for name, text in purposes.items()
    }
    files["README.txt"] = readme.render(
        child=child, files=shown, steps=steps, example=example, note=EXAMPLE_NOTE
    )
    return files


def _is_recorded(seen: Seen, walks: bool) -> bool:
    """Return whether walks with an orthosis may be recorded: those that were given are barefoot."""
    return seen.brace == "worn" or (seen.brace == "planned" and not walks)


def next_steps(seen: Seen, example: bool, walks: bool = False) -> tuple[Step, ...]:
    """Return what to do with a new folder, one command after the other; see `folder_files`."""
    with_orthosis = seen.with_orthosis
    conditions = ("barefoot", "orthosis") if with_orthosis else ("barefoot",)
    problems = [f"mapd-{condition}" for condition in conditions]
    imports = tuple(
        f"pathwalker import c3d/{c} --patient . --condition {c} -o recordings/{c}"
        for c in (conditions if _is_recorded(seen, walks) else conditions[:1])
    )
    recorded: tuple[Step, ...] = (
        Step("Turn the C3D files into joint angles, events and forces.", imports),
        Step("See how well the markers fit.", ("pathwalker ik inverse-kinematics.yaml",)),
        Step(
            "Put strengths and joint ranges from recorded gait into patient.yaml.",
            ("pathwalker id inverse-dynamics.yaml --update-patient",),
        ),
    )
    fill_in = "Fill in patient.yaml" + (" and orthosis.yaml." if with_orthosis else ".")
    if not example and not walks:
        c3d = "With C3D recordings: put them into c3d/barefoot"
        c3d += " and c3d/orthosis" if _is_recorded(seen, walks) else ""
        first = f"{c3d}. Without any, go on with step 5. {recorded[0].why}"
        recorded = (Step(first, imports), *recorded[1:])
    check = f"pathwalker check patient.yaml {' '.join(f'{name}.yaml' for name in problems)}"
    solves = tuple(f"pathwalker solve {n} {n}.yaml --out runs/{n}" for n in problems)
    last = problems[-1]
    study = (
        Step("Ask what softer springs change, and which number of the child matters most.", (
            f"pathwalker perturb perturbation.yaml --run runs/{last}",
            f"pathwalker sensitivity sensitivity.yaml --run runs/{last}",
        ))
        if with_orthosis
        else Step("Ask which number of the child matters most.", (
            f"pathwalker sensitivity sensitivity.yaml --run runs/{last}",
        ))
    )  # fmt: skip
    return (
        *(() if example else (Step(fill_in),)),
        *recorded,
        Step("See what would be solved, and whether all fits together.", (check,)),
        Step("Predict the gait" + (" and identify the springs." if with_orthosis else "."), solves),
        study,
    )


def command_lines(command: str, indent: int = 5) -> str:
    """Return a command for a terminal of 80 columns, its lines joined by backslashes."""
    margin = " " * indent
    if len(margin + command) <= WIDTH:
        return margin + command
    head, mark, tail = command.rpartition(" -o ")
    return f"{margin}{head} \\\n{margin}   {mark}{tail}"


def explained_keys() -> dict[str, dict[str, str]]:
    """Return what the templates say of every key of patient and orthosis, by dotted key."""
    patient: dict[str, str] = {}
    orthosis: dict[str, str] = {}
    _patient(Child("child", 9.0, 29.0, 1.31), Seen(), patient)
    _orthosis(orthosis)
    return {"patient": patient, "orthosis": orthosis}


def _patient(child: Child, seen: Seen, explained: dict[str, str]) -> str:
    """Return the text of the patient's file; take note of what is said of each key."""
    foot = child.length("foot")

    def point(name: str) -> str:
        share = HEEL_SHARE if name == "heel" else TOE_SHARE
        return _pair(share * foot, -ANKLE_HEIGHT * child.height)

    return _environment().get_template("patient.yaml.j2").render(
        child=child,
        with_orthosis=seen.with_orthosis,
        examined=lambda name, usual: (
            _sides(seen.examination[name]) if name in seen.examination else usual
        ),
        lengths=_LENGTHS,
        entry=partial(_entry, Patient, explained),
        num=lambda value: f"{value:g}",
        sides=lambda name: _sides(child.lengths.get(name, (child.length(name),) * 2)),
        length=lambda name: f"{default_length(name, child.height):g}",
        bare="{{heel: {}, toe: {}}}".format(point("heel"), point("toe")),
        soles={
            side: ", ".join(f"{name}: {_pair(*at)}" for name, at in ends.items())
            for side, ends in child.soles.items()
        },
        sole=lambda name: _pair(*(share * child.height for share in _SOLE[name])),
        strength=lambda name: _sides(child.strength(name)),
    )  # fmt: skip


def _orthosis(explained: dict[str, str]) -> str:
    """Return the text of the orthosis' file; take note of what is said of each key."""
    template = _environment().get_template("orthosis.yaml.j2")
    return template.render(entry=partial(_entry, OrthosisData, explained))


def _entry(
    model: type[BaseModel],
    explained: dict[str, str],
    place: str,
    value: str,
    text: str,
    given: bool = True,
    kind: bool = True,
) -> str:
    """Return a key with its value, below what it is, its unit and its range."""
    explained[place] = text
    field = field_at(model, place)
    known = _unit_and_range(*described(field.annotation, list(field.metadata))) if kind else ""
    depth, name = place.count("."), place.rpartition(".")[2]
    return commented(name, value, f"{text} {known}".strip(), depth, given)


def _unit_and_range(kind: str, allowed: str) -> str:
    """Return unit and range of a key, e.g. "[kg], 5 to 150", as a text that does not wrap."""
    unit_in = re.match(r"(?:number|\[lower, upper\]), (?P<unit>[^;]+?)(?:;| or null|$)", kind)
    unit = f"[{unit_in['unit']}]" if unit_in else ""
    return unbroken(", ".join(filter(None, [unit, allowed.replace("`", "")])))


def _sides(values: tuple[float, ...]) -> str:
    """Return one number, or both sides."""
    if len(set(values)) == 1:
        return f"{values[0]:g}"
    return f"{{right: {values[0]:g}, left: {values[1]:g}}}"


def _pair(*values: float) -> str:
    return f"[{', '.join(f'{value:.3f}' for value in values)}]"


def _environment() -> Environment:
    """Return where templates come from; undefined names are errors, blank lines stay as written."""
    environment = templates("pathwalker_cli.starter", escape=False)  # YAML and plain text
    fill: Mapping[str, Any] = {"fill": lambda text: textwrap.fill(text, WIDTH)}
    environment.filters |= {
        **fill,
        "command": command_lines,
        "comment": comment,
        "column": lambda name: f"{name:<26}",
    }
    return environment


def check_new(folder: Path) -> None:
    """Refuse a folder that holds anything, and a file."""
    if folder.exists() and not folder.is_dir():
        raise DataError("is a file, not a folder", where=str(folder), mend="choose another name")
    inside = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    if inside:
        raise DataError(
            f"is not empty: it holds {inside[0]}",
            where=str(folder),
            allowed="a new or empty folder",
            mend="choose another name",
        )


def write_folder(
    folder: Path, child: Child, seen: Seen, example: bool, walks: Sequence[Path] = ()
) -> None:
    """Write a new folder for a child, with made C3D files or copies of barefoot walks if wanted.

    Raises:
        DataError: If the folder is not empty or cannot be written.
        PatientError: If no child of these numbers is accepted.
    """
    check_new(folder)
    with staged_folder(folder) as staging:
        for name, text in folder_files(child, seen, example, bool(walks)).items():
            (staging / name).write_text(text, encoding="utf-8")
        for walk in walks:
            place = staging / "c3d" / "barefoot"
            place.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(walk, place / walk.name)
        try:
            patient = load_patient(staging)
        except PatientError as error:
            where = f"--{error.where.rpartition(' ')[2].replace('body_', '')}"
            raise PatientError(error.what, where=where, allowed=error.allowed) from None
        if example:
            from pathwalker_cli.starter.example import write_example

            write_example(staging, patient, CONDITIONS if seen.with_orthosis else ("barefoot",))
