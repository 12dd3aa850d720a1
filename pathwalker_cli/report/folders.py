"""What the folders of a report are: runs, studies around them, recorded gait, cohorts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.json_file import read_json
from pathwalker_cli.io.yaml_file import validate
from pathwalker_cli.report.summaries import SUMMARIES, Summary
from pathwalker_cli.studies import registry

Kind = str
"""A run, recorded gait, a cohort, or the command of a study."""

STUDIES: Final[Mapping[Kind, str]] = {
    kind: registry.STUDIES[kind].summary for kind in dict.fromkeys((*SUMMARIES, *registry.STUDIES))
}
"""The studies around an optimum and their summaries, in the order of a page."""

_MARKS: Final[Mapping[Kind, str]] = {
    "run": "metrics.json", **STUDIES, "cohort": "cases.csv", "recorded": "stances.csv",
}  # fmt: skip
"""A file that only such a folder has."""

_ALLOWED: Final = (
    f"folders that solve, id, batch, {', '.join([*STUDIES][:-1])} or {[*STUDIES][-1]} of "
    "pathwalker wrote"
)

_SAME: Final = 0.02
"""Relative difference up to which a study stands on a run: it solves the optimum again, to a
tolerance of its own, which may move springs that the cost does not determine."""


@dataclass(frozen=True)
class Study:
    """A study around an optimum: its folder, its command, its summary, and the same as a type."""

    folder: Path
    kind: Kind
    content: Mapping[str, Any]
    summary: BaseModel

    @property
    def optimum(self) -> Mapping[str, Any]:
        """Measures of the optimum that it stands on."""
        measures = self.content.get("optimum", self.content.get("base"))
        if measures is None and isinstance(start := self.content.get("start"), Mapping):
            measures = start.get("measures")
        return measures if isinstance(measures, Mapping) else {}

    def stands_on(self, metrics: Mapping[str, Any]) -> bool:
        """Return whether a run is the one around which the study was made.

        What was learnt stands on no run, but belongs to a patient.
        """
        if self.kind == "learn":
            return bool(self.content.get("patient") == metrics.get("patient"))
        if any(self.content.get(key) != metrics.get(key) for key in ("problem", "patient")):
            return False
        optimum = self.optimum
        return all(_near(optimum.get(key), metrics.get(key)) for key in ("cost", "walking_speed"))


def _near(one: Any, other: Any) -> bool:
    numbers = isinstance(one, int | float) and isinstance(other, int | float)
    return numbers and abs(one - other) <= _SAME * max(abs(one), abs(other))


def folder_kind(folder: Path) -> Kind:
    """Return what a folder is.

    Raises:
        DataError: If it is nothing that a report can be made of.
    """
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "no such folder"
        raise DataError(what, where=str(folder), allowed=_ALLOWED)
    kind = kind_of(folder)
    if kind is None:
        raise DataError("holds nothing to report", where=str(folder), allowed=_ALLOWED)
    return kind


def kind_of(folder: Path) -> Kind | None:
    """Return what a folder is, None if it is nothing that a report can be made of."""
    return next((kind for kind, file in _MARKS.items() if (folder / file).is_file()), None)


def sorted_folders(folders: Sequence[Path]) -> dict[Kind, tuple[Path, ...]]:
    """Return folders by what they are, in the order given.

    Raises:
        DataError: If one is named twice, is nothing to report, or they do not go together.
    """
    by_kind: dict[Kind, tuple[Path, ...]] = {}
    places = [folder.resolve() for folder in folders]
    for folder, place in zip(folders, places, strict=True):
        if places.count(place) > 1:
            raise DataError("is named twice", where=str(folder), allowed="each folder once")
        kind = folder_kind(folder)
        by_kind[kind] = (*by_kind.get(kind, ()), folder)
    pages = [kind for kind in ("run", "recorded", "cohort") if kind in by_kind]
    studies = [kind for kind in by_kind if kind in STUDIES]
    if len(pages) > 1:
        raise DataError(
            f"{by_kind[pages[0]][0]} and {by_kind[pages[1]][0]} do not go on one page",
            allowed="runs with their studies, or folders of id, or folders of batch",
            mend="write a report for each",
        )
    if studies and pages != ["run"]:
        raise DataError(
            "is a study around a run that was not named",
            where=str(by_kind[studies[0]][0]),
            mend="name the run too",
        )
    return by_kind


def studies_near(
    runs: Sequence[tuple[Path, Mapping[str, Any]]], named: Mapping[Kind, Sequence[Path]]
) -> tuple[Study, ...]:
    """Return the studies that stand on one of the runs: named ones, and those found near.

    A run is its folder and its metrics.  Near is inside that folder, beside it, or around it. Of
    each kind at most one counts.

    Raises:
        DataError: If a study that was named stands on none of the runs.
    """
    studies: dict[Kind, Study] = {}
    for kind in STUDIES:
        for folder in named.get(kind, ()):
            study = _study(folder, kind)
            if not any(study.stands_on(metrics) for _, metrics in runs):
                raise DataError(
                    "stands on another optimum than the runs of this report",
                    where=str(folder),
                    allowed="a study around one of them (--run RUN)",
                )
            if kind in studies:
                raise DataError(f"is a second {kind} study", where=str(folder), allowed="one")
            studies[kind] = study
    for folder, metrics in runs:
        for kind, place in _near_folders(folder):
            with suppress(DataError):  # nobody named it
                study = _study(place, kind)
                if kind not in studies and study.stands_on(metrics):
                    studies[kind] = study
    return tuple(studies[kind] for kind in STUDIES if kind in studies)


def _study(folder: Path, kind: Kind) -> Study:
    path = folder / STUDIES[kind]
    content = read_json(path, mend="make the study again")
    model = SUMMARIES.get(kind, Summary)
    return Study(folder, kind, content, validate(content, model, where=str(path), error=DataError))


def _near_folders(folder: Path) -> list[tuple[Kind, Path]]:
    """Return the studies near a run."""
    around = folder.resolve().parent
    try:
        places = sorted({around, *folder.resolve().iterdir(), *around.iterdir()})
    except OSError:
        return []
    kinds = [(kind_of(place), place) for place in places if place.is_dir()]
    return [(kind, place) for kind, place in kinds if kind in STUDIES and kind is not None]
