"""From the file of a study to its cases: every patient, problem and override, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig, place_of, with_values
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.studies.batch.checks import check_case, check_warm_start
from pathwalker_cli.studies.batch.names import case_name, short_keys
from pathwalker_cli.studies.batch.people import listed_patients, listed_problems
from pathwalker_cli.studies.batch.schema import BatchStudy, NamedCase, flat, load_batch

__all__ = ["Batch", "BatchCase", "load_cases"]


@dataclass(frozen=True)
class BatchCase:
    """One patient in one problem with its overrides.

    Args:
        name: Its name, and that of its run folder.
        problem: Name of the problem in the study.
        study: What is solved, and for whom.
        values: What the grid varies, by dotted key.
        variant: Name of the overrides that belong together; "" without.
        warm_start: Run to begin with.
    """

    name: str
    problem: str
    study: Case
    values: Mapping[str, Any] = field(default_factory=dict)
    variant: str = ""
    warm_start: Path | None = None

    @property
    def patient(self) -> str:
        """Id of the patient."""
        return self.study.unvaried.id


@dataclass(frozen=True)
class Batch:
    """A study of many cases, checked.

    Args:
        name: Its name: that of its file.
        cases: The cases in order.
    """

    name: str
    cases: tuple[BatchCase, ...]


def load_cases(path: str | Path, changes: tuple[str, ...] = ()) -> Batch:
    """Read a study and check every case before the first is solved.

    Args:
        path: The YAML file, or the name of a shipped one.
        changes: Overrides "key=value" of the study's own keys.

    Raises:
        InputError: If study, patient, config, warm start or a combination of them is wrong.
    """
    study, source = load_batch(path, changes)
    where = str(path)
    folders = {key: place_of(key, source, changes) for key in ("patients", "problems")}
    patients = listed_patients(study.patients, folders["patients"], source, where)
    problems = {
        name: overridden(config, study.set, f"{where}, set, problem {name}")
        for name, config in listed_problems(study.problems, folders["problems"], where).items()
    }
    warm_starts = _warm_starts(study, problems, source, where)
    cases: dict[str, BatchCase] = {}
    known: dict[str, str] = {}
    for entry, patient in patients.items():
        for name, config in problems.items():
            base = Case(config.model_copy(update={"patient": entry}), patient)
            for case in _variants(study, name, base, where):
                _check_new(case, cases, known, where)
                check_case(case.name, case.study, where)
                cases[case.name] = replace(case, warm_start=warm_starts.get(name))
    return Batch(source.stem, tuple(cases.values()))


def overridden(config: StudyConfig, values: Mapping[str, Any], where: str) -> StudyConfig:
    """Return a config with overrides by dotted key.

    What follows "variation.scale." or "variation.shift." is one place in the patient's file.

    Raises:
        ConfigError: If a key does not exist or a value is refused.
    """
    plain: dict[str, Any] = {}
    for key, value in flat(values).items():
        block, kind, place = (*key.split(".", 2), "", "")[:3]
        if block != "variation" or not place:
            plain[key] = value
            continue
        whole = f"{block}.{kind}"
        before = plain.get(whole, getattr(config.variation, kind, {}))
        plain[whole] = {**before, place: value} if isinstance(before, Mapping) else before
    return with_values(config, plain, where) if plain else config


def _variants(study: BatchStudy, problem: str, base: Case, where: str) -> Iterator[BatchCase]:
    """Yield all cases of one patient in one problem."""
    short = short_keys(study.grid)
    for combination in product(*study.grid.values()):
        values = dict(zip(study.grid, combination, strict=True))
        for variant in study.cases or (NamedCase(name="all"),):
            label = variant.name if study.cases else ""
            shown = {short[key]: value for key, value in values.items()}
            name = case_name(base.unvaried.id, problem, shown, label)
            changes = {**values, **flat(variant.set)}
            config = overridden(base.config, changes, f"{where}, case {name}")
            yield BatchCase(name, problem, replace(base, config=config), values, label)


def _check_new(
    case: BatchCase, cases: Mapping[str, BatchCase], known: dict[str, str], where: str
) -> None:
    """Refuse a case whose name or content is there already.

    Raises:
        ConfigError: If there is such a case.
    """
    content = case.study.config.model_dump_json()
    if case.name in cases or content in known:
        other = known.get(content, case.name)
        same = f"cases {other} and {case.name} are the same"
        raise ConfigError(
            same if content in known else f"two cases are named {case.name}",
            where=where,
            mend="look for what stands twice in patients, problems, grid or cases",
        )
    known[content] = case.name


def _warm_starts(
    study: BatchStudy, problems: Mapping[str, StudyConfig], source: Path, where: str
) -> dict[str, Path]:
    """Return the folder of the run that the cases of each problem begin with."""
    found = {}
    for name, folder in study.warm_start.items():
        place = f"{where}: warm_start.{name}"
        if name not in problems:
            raise ConfigError("is no problem of this study", where=place,
                              allowed=", ".join(problems))  # fmt: skip
        found[name] = (source.parent / folder).resolve()
        check_warm_start(found[name], problems[name], place)
    return found
