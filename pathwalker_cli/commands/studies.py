"""The commands that solve neighbours of one optimum: perturb, sensitivity, uncertainty and more."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

from pathwalker_cli.commands.complete import complete_configs, complete_runs
from pathwalker_cli.commands.options import (
    json_option,
    meant_as,
    print_json,
    quiet_option,
    set_option,
)

if TYPE_CHECKING:
    from pathwalker_cli.results.run_folder import Run
    from pathwalker_cli.studies.base import NeighbourStudy
    from pathwalker_cli.studies.pool import Solved

    Study = TypeVar("Study", bound=NeighbourStudy)

__all__ = [
    "landscape_command",
    "perturb_command",
    "sensitivity_command",
    "tradeoff_command",
    "uncertainty_command",
]

_EVERY: Final = 10
"""Draws between two lines of progress."""


@dataclass(frozen=True)
class StudyCall:
    """A study as it was called.

    Args:
        config: Its config, a file or the name of a shipped one.
        out: Folder of the results.
        run: Folder of the run to stand on; None to solve the base of the study.
        changes: Overrides "dotted.key=value".
        quiet: Whether to show nothing.
        as_json: Whether to print one document.
        workers: Processes; None for as many as there are cores.
    """

    config: str
    out: Path
    run: Path | None
    changes: tuple[str, ...]
    quiet: bool
    as_json: bool
    workers: int | None = None

    def load(self, kind: str, model: type[Study]) -> Study:
        """Return the study of the config."""
        from pathwalker_cli.studies.base import load_study

        with meant_as(kind, self.config):
            return load_study(self.config, model, self.changes)

    def say(self, line: str) -> None:
        """Show one line of progress on stderr."""
        if not self.quiet:
            click.echo(line, err=True)

    def base(self, study: NeighbourStudy, springs: bool = False) -> Run:
        """Return the run that a study stands on, read or solved now.

        Args:
            study: The study.
            springs: Whether it must have some.

        Raises:
            ConfigError: If the study also overrides its values, or there are no springs in it.
            DataError: If the run cannot be used.
            NotConvergedError: If the base did not converge.
        """
        from pathwalker_cli.commands.progress import Progress
        from pathwalker_cli.studies.base import base_case, base_run
        from pathwalker_cli.studies.springs import require_springs

        if self.run is not None:
            run = _given(study, self.run)
            if springs:
                require_springs(run.config, f"--run {self.run}")
            return run
        case = base_case(study)
        if springs:
            require_springs(case.config, f"base {study.base}")
        with Progress(self.quiet) as progress:
            return base_run(case, self.out / "base", progress)

    def report(self, content: Mapping[str, Any], lines: Iterable[str]) -> None:
        """Print what came out, as a document or as lines."""
        if self.as_json:
            print_json({"folder": str(self.out), **content})
        elif not self.quiet:
            click.echo("\n".join([*lines, f"\nWritten to {self.out}"]))


def _given(study: NeighbourStudy, folder: Path) -> Run:
    """Return the run that was named.

    Raises:
        ConfigError: If the study overrides values of the base.
        DataError: If the run cannot be used.
    """
    from pathwalker_cli.errors import ConfigError, DataError, NotConvergedError
    from pathwalker_cli.results.run_folder import load_run

    if study.set:
        raise ConfigError(
            "overrides values of the base, but --run brings a config of its own",
            where="set",
            mend="leave one of the two out",
        )
    try:
        return load_run(folder)
    except NotConvergedError as error:
        raise DataError(str(error), where="--run", allowed="a converged run") from None


Command = Callable[..., Any]


def _study(
    name: str, out: str = "", *more: Callable[[Command], Command]
) -> Callable[[Callable[[StudyCall], None]], Command]:
    """Return what makes a command of a function: argument and options of a study.

    Args:
        name: Name of the command.
        out: Name below runs/ of the folder of the results; that of the command if left out.
        more: Further options.
    """
    options: tuple[Callable[[Command], Command], ...] = (
        click.argument("config", metavar="CONFIG", shell_complete=complete_configs),
        click.option(
            "--out",
            type=click.Path(path_type=Path),
            default=Path("runs", out or name),
            show_default=True,
            metavar="DIR",
            help="Folder of the results; what is solved there already is kept.",
        ),
        click.option(
            "--run",
            type=click.Path(path_type=Path),
            metavar="RUN",
            shell_complete=complete_runs,
            help="Folder of a converged run to stand on, instead of solving the base.",
        ),
        set_option("Override a value of CONFIG; 'set={KEY: VALUE}' overrides one of the base."),
        quiet_option,
        json_option,
        *more,
    )

    def decorate(function: Callable[[StudyCall], None]) -> Command:
        @wraps(function)
        def call(**words: Any) -> None:
            function(StudyCall(**words))

        command: Command = call
        for option in reversed(options):
            command = option(command)
        return click.command(name)(command)

    return decorate


@_study("perturb", "perturbation")
def perturb_command(call: StudyCall) -> None:
    """Move every orthosis spring a little from its optimum and solve all the rest again.

    CONFIG is a YAML file or the name of a shipped one (perturbation). Changes of cost, crouch,
    steps and speed stand beside table 5 of the article where the two are about the same patient.
    An interrupted call goes on where it was. Exit codes: 0 all converged, 1 some solve did not,
    2 bad input.
    """
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import claimed_folder
    from pathwalker_cli.studies.perturbation.figures import save_perturbation_figure
    from pathwalker_cli.studies.perturbation.study import PerturbationStudy, perturb
    from pathwalker_cli.studies.perturbation.text import (
        FILES,
        perturbation_content,
        perturbation_lines,
        write_perturbation,
    )

    study = call.load("perturbation", PerturbationStudy)
    with claimed_folder(call.out, frozenset({"base", "points", "figures", *FILES}), "perturb"):
        result = perturb(
            study,
            call.base(study, springs=True),
            call.out,
            lambda row: call.say(
                f"{row.label}: {row.status}, {row.iterations} iterations, {row.seconds:.1f} s"
            ),
        )
        write_perturbation(result, call.out)
        save_perturbation_figure(result, call.out / "figures")
    call.report(perturbation_content(result), perturbation_lines(result))
    if result.failed:
        failed = ", ".join(row.label for row in result.failed)
        raise NotConvergedError(f"no solution was found for {failed}; {call.out} holds the others")


@_study("sensitivity")
def sensitivity_command(call: StudyCall) -> None:
    """Tell what one percent of every number would change, without solving again.

    CONFIG is a YAML file or the name of a shipped one (sensitivity). Springs, orthosis, strengths,
    mass and lengths are asked about, one by one; the derivatives of cost and of every gait metric
    come from the optimality conditions. Exit codes: 0 done, 1 the base did not converge, 2 bad
    input.
    """
    from pathwalker_cli.studies.base import claimed_folder
    from pathwalker_cli.studies.sensitivity.figures import save_sensitivity_figure
    from pathwalker_cli.studies.sensitivity.study import SensitivityStudy, sensitivities
    from pathwalker_cli.studies.sensitivity.text import (
        FILES,
        sensitivity_content,
        sensitivity_lines,
        write_sensitivities,
    )

    study = call.load("sensitivity", SensitivityStudy)
    with claimed_folder(call.out, frozenset({"base", "points", "figures", *FILES}), "sensitivity"):
        result = sensitivities(study, call.base(study), call.out)
        write_sensitivities(result, call.out)
        save_sensitivity_figure(result, call.out / "figures")
    call.report(sensitivity_content(result), sensitivity_lines(result))


@_study(
    "uncertainty",
    "",
    click.option(
        "--workers",
        type=click.IntRange(1, 1000),
        metavar="N",
        help="Processes that solve; as many as there are cores if left out. Results are the same.",
    ),
)
def uncertainty_command(call: StudyCall) -> None:
    """Draw the uncertain numbers of a patient and identify the springs anew for every draw.

    CONFIG is a YAML file or the name of a shipped one (uncertainty): what is uncertain, and by how
    much. Tells how far springs, cost and gait spread, how often a spring sits at a limit, and
    which number matters most. An interrupted call goes on where it was. Exit codes: 0 all draws
    converged, 1 some did not, 2 bad input.
    """
    import os

    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import claimed_folder
    from pathwalker_cli.studies.uncertainty.figures import save_uncertainty_figures
    from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy, uncertainty
    from pathwalker_cli.studies.uncertainty.text import (
        FILES,
        uncertainty_content,
        uncertainty_lines,
        write_uncertainty,
    )

    study = call.load("uncertainty", UncertaintyStudy)
    count = call.workers or len(os.sched_getaffinity(0))
    entries = frozenset({"base", "draws", "figures", *FILES})
    with claimed_folder(call.out, entries, "uncertainty"):
        base = call.base(study, springs=True)
        result = uncertainty(study, base, call.out, count, _counted(study.draws, call.say))
        write_uncertainty(result, call.out)
        save_uncertainty_figures(result, call.out / "figures")
    call.report(uncertainty_content(result), uncertainty_lines(result))
    if result.failed:
        raise NotConvergedError(
            f"{len(result.failed)} of {len(result.solved)} draws did not converge; {call.out} "
            "holds the others, and what was drawn for these"
        )


def _counted(total: int, say: Callable[[str], None]) -> Callable[[Solved], None]:
    """Return what says how many draws are done, and names failed ones at once."""
    done = 0

    def count(solved: Solved) -> None:
        nonlocal done
        done += 1
        if solved.status != "converged":
            say(f"{solved.name}: {solved.status}")
        if done % _EVERY == 0 or done == total:
            say(f"{done} of {total} draws")

    return count


@_study("landscape")
def landscape_command(call: StudyCall) -> None:
    """Map the cost over K_D and K_P of a side, as CONFIG says, and the region of nearly best ones.

    CONFIG is a YAML file or the name of a shipped one. Every point is solved from its neighbours,
    those on another branch too, and kept in DIR/points: the same command goes on after a stop.
    DIR/landscape.csv, DIR/landscape.json and DIR/figures hold the result. Exit codes: 0 done, 1 the
    base did not converge or Ctrl-C, 2 bad input.
    """
    from pathwalker_cli.studies.base import claimed_folder
    from pathwalker_cli.studies.landscape.files import ENTRIES, landscape_content, write_landscape
    from pathwalker_cli.studies.landscape.solve import landscape_of
    from pathwalker_cli.studies.landscape.study import LandscapeStudy
    from pathwalker_cli.studies.landscape.text import landscape_lines

    study = call.load("landscape", LandscapeStudy)
    with claimed_folder(call.out, ENTRIES, "landscape"):
        landscape = landscape_of(study, call.base(study), call.out / "points", call.say)
        write_landscape(call.out, landscape)
    call.report(landscape_content(landscape), landscape_lines(landscape))


@_study("tradeoff")
def tradeoff_command(call: StudyCall) -> None:
    """Find the front of effort per distance and walking speed, as CONFIG says.

    CONFIG is a YAML file or the name of a shipped one. The problem is solved for a chain of weights
    of speed, to and fro; points for which the mesh of the base is too coarse are solved again on a
    finer one, into DIR/runs. The same command goes on after a stop. DIR/tradeoff.csv and
    DIR/figures hold the result. Exit codes: 0 done, 1 the base did not converge or Ctrl-C, 2 bad
    input.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.studies.base import claimed_folder
    from pathwalker_cli.studies.tradeoff.files import ENTRIES, tradeoff_content, write_tradeoff
    from pathwalker_cli.studies.tradeoff.study import TradeoffStudy, tradeoff_of
    from pathwalker_cli.studies.tradeoff.text import tradeoff_lines

    study = call.load("tradeoff", TradeoffStudy)
    with claimed_folder(call.out, ENTRIES, "tradeoff"):
        tradeoff = tradeoff_of(study, call.base(study), call.out, call.say, Progress(quiet=True))
        write_tradeoff(call.out, tradeoff)
    call.report(tradeoff_content(tradeoff), tradeoff_lines(tradeoff))
