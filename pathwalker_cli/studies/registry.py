"""All studies around an optimum: what is known of each before it is loaded, and where it stands.

A new study is a module or package that holds its `STUDY`, and one entry here: its command, its
check, its references and its place in reports come from the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pathwalker_cli.studies.base import StudyKind


@dataclass(frozen=True)
class StudyEntry:
    """A study by what people see of it, and the module where its `STUDY` stands.

    Its name is that of its shipped config, of its summary and of the folder of its results;
    `heading` is that of the keys of its config in the reference. Processes may share its solves.
    """

    name: str
    title: str
    help: str
    heading: str
    module: str
    parallel: bool = False

    @property
    def summary(self) -> str:
        """Name of the file by which a folder of its results is known."""
        return f"{self.name}.json"

    def load(self) -> StudyKind[Any, Any]:
        """Return the study itself; what it needs is imported now."""
        kind: StudyKind[Any, Any] = import_module(self.module).STUDY
        return kind


STUDIES: Final[dict[str, StudyEntry]] = {
    "perturb": StudyEntry(
        "perturbation",
        "Move every orthosis spring a little and see what changes.",
        """Move every orthosis spring a little from its optimum and solve all the rest again.

        CONFIG is a YAML file or the name of a shipped one (perturbation). Changes of cost, crouch,
        steps and speed stand beside table 5 of the article where the two are about the same
        patient. An interrupted call goes on where it was. Exit codes: 0 all converged, 1 some
        solve did not, 2 bad input.
        """,
        "Softer and stiffer springs",
        "pathwalker_cli.studies.perturbation",
    ),
    "sensitivity": StudyEntry(
        "sensitivity",
        "Tell what one percent of every number of patient and orthosis changes.",
        """Tell what one percent of every number would change, without solving again.

        CONFIG is a YAML file or the name of a shipped one (sensitivity). Springs, orthosis,
        strengths, mass and lengths are asked about, one by one; the derivatives of cost and of
        every gait metric come from the optimality conditions. Exit codes: 0 done, 1 the base did
        not converge, 2 bad input.
        """,
        "What one percent changes",
        "pathwalker_cli.studies.sensitivity",
    ),
    "uncertainty": StudyEntry(
        "uncertainty",
        "Draw the uncertain numbers of a patient and see how far the answers spread.",
        """Draw the uncertain numbers of a patient and identify the springs anew for every draw.

        CONFIG is a YAML file or the name of a shipped one (uncertainty): what is uncertain, and by
        how much. Tells how far springs, cost and gait spread, how often a spring sits at a limit,
        and which number matters most. An interrupted call goes on where it was. Exit codes: 0 all
        draws converged, 1 some did not, 2 bad input.
        """,
        "Uncertain numbers of the patient",
        "pathwalker_cli.studies.uncertainty",
        parallel=True,
    ),
    "learn": StudyEntry(
        "learn",
        "Learn from recordings how a child walks: tissue, strengths, and what its walking costs.",
        """Learn the numbers with which predicted walking is nearest to the recorded one.

        CONFIG is a YAML file or the name of a shipped one (learn): which numbers, with what is
        thought of each before, and from which problem's recordings. DIR/learnt.yaml holds them
        with their covariance; a config takes them by `learnt: FILE`. An interrupted call goes on
        where it was. Exit codes: 0 done, 1 no prediction to begin with, 2 bad input.
        """,
        "Learning from recordings",
        "pathwalker_cli.studies.learn",
    ),
    "landscape": StudyEntry(
        "landscape",
        "Map the cost over the spring stiffnesses of a side.",
        """Map the cost over K_D and K_P of a side, as CONFIG says, and the region of nearly best
        ones.

        CONFIG is a YAML file or the name of a shipped one. Every point is solved from its
        neighbours, those on another branch too, and kept in DIR/points: the same command goes on
        after a stop. DIR/landscape.csv, DIR/landscape.json and DIR/figures hold the result. Exit
        codes: 0 done, 1 the base did not converge or Ctrl-C, 2 bad input.
        """,
        "Cost over the springs",
        "pathwalker_cli.studies.landscape",
    ),
    "tradeoff": StudyEntry(
        "tradeoff",
        "Find what walking faster costs, and which springs suit which speed.",
        """Find the front of effort per distance and walking speed, as CONFIG says.

        CONFIG is a YAML file or the name of a shipped one. The problem is solved for a chain of
        weights of speed, to and fro; points for which the mesh of the base is too coarse are solved
        again on a finer one, into DIR/runs. The same command goes on after a stop. DIR/tradeoff.csv
        and DIR/figures hold the result. Exit codes: 0 done, 1 the base did not converge or Ctrl-C,
        2 bad input.
        """,
        "Effort against speed",
        "pathwalker_cli.studies.tradeoff",
    ),
}  # fmt: skip
"""Every study by its command."""
