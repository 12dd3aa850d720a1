"""Write `patient-file.md`: every key of a patient's file with type, range, default and meaning.

Keys, types, ranges and defaults come from the models that validate the file.

python docs/generate_patient_file.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, get_args, get_origin

from generate_configuration import row
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pathwalker_cli.io.fields import Sides, is_model, side_type
from pathwalker_cli.patient import Patient

PAGE: Final = Path(__file__).with_name("patient-file.md")

_HEAD: Final = """\
# Patient file

<!-- Written by docs/generate_patient_file.py from the models that validate the file: change those, and
the meanings in the script, not this. -->

Every key of a patient's YAML file. [Your own patient](own-patient.md) tells how to write one; the shipped
`patient_data/sreenivasa2017-patient/patient.yaml` is a complete example.

Units are SI and radians and are not written beside a number, but for angles in degrees (`7.5 deg`) and stiffnesses per degree
(`1.6 N m/deg`). Angles are positive in hip extension, knee
flexion and ankle plantarflexion ([conventions](conventions.md)). Where the type says *per side*, one value
counts for both sides, and `{right: 18.6, left: 30.4}` tells them apart. Unknown keys and numbers outside their
range are refused with one sentence that names file, line and key. `null` means left out.
"""

_ABOUT: Final = {
    "segment_lengths": "Joint centre to joint centre, from motion capture or a measuring tape. Every length may "
    "be left out: it then comes from adult proportions of body height, and every run says so.",
    "contact_points": "Heel and toe of the rigid foot, `[forward, up]` of the ankle joint [m], with the foot at "
    "90 degrees to the shank. One pair counts for both feet; `{right: {heel: ..., toe: ...}, left: ...}` tells them "
    "apart.",
    "rocker_radius": "Radii of the circles on which heel and ball of the foot roll, barefoot and shod, and of the ends of "
    "a sole. They count in problems with `model.feet` rockers or sole; what is left out is a share of the length of the "
    "foot.",
    "strengths": "Maximum isometric torques. Needed for predictions, not for recorded gait; `pathwalker id` "
    "estimates them from recordings. Given, the block must be complete.",
    "examination": "Passive range of motion from the couch, in degrees. Counts in problems with `model.tissue: true`; "
    "what is left out is that of typical children.",
    "orthosis": "Needed for problems with orthoses. One number counts for every leg that wears one, and any may differ by "
    "side. With `sides: [left]` the right leg has no spring, stop, mass or sole of an orthosis, and nothing may be given for it. "
    "`orthosis:` may also be the path of a YAML file with this block, relative to the patient's file, that several patients share.",
    "recorded": "What was recorded, per condition: `recorded.barefoot` and `recorded.orthosis` have the same keys. "
    "The barefoot ones give the bounds of predictions: least walking speed and joint ranges.",
}
"""What stands at the head of every block."""

_SPRINGS: Final = (
    "springs that exist, each `{name: stiff, stiffness: 91.7}`; the answer is rounded to them"
)

MEANINGS: Final = {
    "id": "name of the patient, of run folders and of table rows",
    "description": "for people",
    "numbers": "values of further numbers of the model by address, e.g. of a force element of one's own; one without "
    "side counts for both",
    "sex": "segment masses follow from boys in either case; for a girl every run says so",
    "age": "segment masses follow from it",
    "age_for_regressions": "age for the segment masses, if another one fits better, or the child is younger or "
    "older than the regressions",
    "age_for_regressions_reason": "why; needed with it",
    "body_mass": "without orthoses and shoes",
    "height": "",
    "segment_lengths.pelvis": "height of the pelvis segment",
    "segment_lengths.hip_drop": "hips below the pelvis origin",
    "segment_lengths.lumbar_height": "lumbar joint above the pelvis origin",
    "segment_lengths.trunk": "",
    "segment_lengths.head": "",
    "segment_lengths.shoulder_height": "shoulders above the lumbar joint",
    "segment_lengths.upper_arm": "",
    "segment_lengths.lower_arm": "",
    "segment_lengths.hand": "",
    "segment_lengths.thigh": "hip to knee",
    "segment_lengths.shank": "knee to ankle",
    "segment_lengths.foot": "heel marker to toe marker",
    "contact_points.barefoot.heel": "left out: from foot length and height by proportion",
    "contact_points.barefoot.toe": "",
    "contact_points.orthosis.heel": "sole of the shoe that is worn with the orthosis; needed with one. A foot without orthosis is "
    "bare, unless its own pair is given",
    "contact_points.orthosis.toe": "",
    "rocker_radius.heel": "left out: 0.18 of the foot's length",
    "rocker_radius.toe": "left out: 0.18 of the foot's length",
    "sole_roundness": "radius of a sole where it lies flat, in distances from heel to toe, for `model.feet: sole`; "
    "left out: 1.5",
    "strengths.hip_extension": "",
    "strengths.hip_flexion": "",
    "strengths.knee_extension": "",
    "strengths.knee_flexion": "",
    "strengths.ankle_extension": "plantarflexion",
    "strengths.ankle_flexion": "dorsiflexion",
    "strengths.lumbar_extension": "bends the trunk forward, as in the published model",
    "strengths.lumbar_flexion": "extends the trunk",
    "examination.hip_extension": "Thomas test: extension of the hip with the other one flexed; typical 10",
    "examination.popliteal_angle": "knee flexion left with the hip at 90, leg lifted until it resists; typical 26",
    "examination.knee_extension": "negative where the knee does not straighten; typical 0",
    "examination.dorsiflexion_knee_extended": "with the knee straight; typical 13",
    "examination.dorsiflexion_knee_flexed": "with the knee at 90; typical 32",
    "orthosis.cuff_height": "middle of the cuff above the ankle, for its force on the leg; left out: 0.7 of the shank",
    "orthosis.cuff_area": "area on which the cuff presses, in front or behind; left out: 0.06 of the squared shank",
    "orthosis.hinge.forward": "hinge of the shell in front of the ankle, in the frame of the foot, with `model.orthosis: body`; "
    "left out: 0, on the axis",
    "orthosis.hinge.up": "the same above the ankle",
    "orthosis.cuff_stiffness.across": "force on the leg by how deep the cuff is pressed into it, with `model.orthosis: body`; left "
    "out: 60 kPa times the area of the cuff, over 0.06 of the shank",
    "orthosis.cuff_stiffness.along": "force by how far the cuff slides along the leg; left out: a third of it across",
    "orthosis.cuff_damping.across": "force by speed; left out: the stiffness times 10 ms",
    "orthosis.cuff_damping.along": "the same along the leg",
    "orthosis.sides": "the legs that wear one",
    "orthosis.mass.shank": "what orthosis and shoe add to the shank",
    "orthosis.mass.foot": "the same of the foot",
    "orthosis.neutral_angle": "ankle angle at which the springs give no torque",
    "orthosis.free_play": "width of the play around the neutral angle",
    "orthosis.preload_torque": "torque at the edge of the free play, where the spring begins to work",
    "orthosis.dorsiflexion_stop": "ankle angle of the hard stop",
    "orthosis.plantarflexion_stop": "ankle angle of the hard stop",
    "orthosis.stop_stiffness.dorsiflexion": "of the stop itself, shell and stirrup; measured, see [own orthosis](own-orthosis.md)",
    "orthosis.stop_stiffness.plantarflexion": "the same in plantarflexion",
    "orthosis.stiffness_guess.dorsiflexion": "K_D at which the search begins",
    "orthosis.stiffness_guess.plantarflexion": "K_P at which the search begins",
    "orthosis.stiffness_range.dorsiflexion": "K_D that can be had",
    "orthosis.stiffness_range.plantarflexion": "K_P that can be had",
    "orthosis.stiffness_range.source": "who says so",
    "orthosis.springs.dorsiflexion": _SPRINGS,
    "orthosis.springs.plantarflexion": _SPRINGS,
    "orthosis.springs.source": "who says so",
    "recorded.barefoot.walking_speed.mean": "least speed of a prediction, unless the config says another",
    "recorded.barefoot.walking_speed.min": "",
    "recorded.barefoot.walking_speed.max": "",
    "recorded.barefoot.step_length.min": "from flat heel to flat heel; `right` and `left` may be told apart",
    "recorded.barefoot.step_length.max": "",
    "recorded.barefoot.joint_ranges": "per coordinate but the pelvis position; widened by "
    "`bounds.joint_range_margin`, the joint ranges of a prediction",
}
"""What every key means; a key that is missing here stops the script."""


def page() -> str:
    """Return the whole page."""
    blocks: dict[str, list[str]] = {"": []}
    for key, field in _leaves(Patient, ""):
        heading = key.partition(".")[0] if "." in key else ""
        text = row(key, field, MEANINGS[key])
        if key.startswith("contact_points."):
            text = text.replace("[lower, upper]", "[forward, up]")
        blocks.setdefault(heading, []).append(text)
    parts = [_HEAD]
    for name, rows in blocks.items():
        parts += [f"## {name or 'The child'}\n", *([f"{_ABOUT[name]}\n"] if name else [])]
        header = ["| key | type | allowed | default | meaning |", "| --- | --- | --- | --- | --- |"]
        parts.append("\n".join([*header, *rows, ""]))
    return "\n".join(parts)


def _leaves(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, FieldInfo]]:
    """Yield dotted name and field of every key that holds no further keys."""
    for name, field in model.model_fields.items():
        block = _block(field.annotation)
        if block is None:
            yield f"{prefix}{name}", field
        elif name == "recorded":
            yield from _leaves(block, f"{prefix}{name}.barefoot.")
        else:
            yield from _leaves(block, f"{prefix}{name}.")


def _block(annotation: Any) -> type[BaseModel] | None:
    """Return the block of keys behind an annotation: itself, per side, per name, or absent."""
    if get_origin(annotation) is tuple:
        return None
    for candidate in (annotation, *get_args(annotation)):
        if is_model(candidate):
            inner = side_type(candidate) if issubclass(candidate, Sides) else candidate
            if is_model(inner):
                return inner
    return None


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
