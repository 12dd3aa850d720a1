"""The command line: finds commands, and turns errors into sentences and exit codes."""

from __future__ import annotations

import errno
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Final, NoReturn

import click

from pathwalker_cli import __version__
from pathwalker_cli.commands.examples import examples_epilog
from pathwalker_cli.commands.options import print_failure
from pathwalker_cli.errors import NotConvergedError, PathwalkerError
from pathwalker_cli.studies.registry import STUDIES

NOT_CONVERGED: Final = 1
"""Exit code of a solve that did not converge."""
REFUSED: Final = 2
"""Exit code of input that cannot be used, as of wrong usage."""
STOPPED_TEXT: Final = "stopped by the user; what was finished before is kept"
STOPPED: Final = 130
"""Exit code after Ctrl-C, by custom 128 + SIGINT."""

COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "solve": ("solve", "Predict the gait of a patient by optimal control."),
    **{name: ("studies", entry.title) for name, entry in STUDIES.items()},
    "evaluate": ("compare", "Compare predicted gait with the recordings of the patient."),
    "verify": ("verify", "Check run folders: files, equations of motion, balances, optimality."),
    "rerun": ("verify", "Solve a run again from its folder alone and tell how the two differ."),
    "compare": ("compare", "Compare the metrics of runs, with differences and figures."),
    "report": ("pages", "Write one HTML page about runs, recorded gait or a cohort."),
    "reproduce": (
        "reproduce",
        "Reproduce the article from the shipped data, with one page of results.",
    ),
    "batch": (
        "batch",
        "Solve every case of a study: patients, problems and overrides in any number.",
    ),
    "animate": (
        "pages",
        "Draw the walker of one or two runs, moving: a page for the browser, a GIF or an MP4.",
    ),
    "explore": ("explore", "Turn the numbers of a run on a page and see how the walk changes."),
    "view": ("pages", "Show the stride of a run in 3D."),
    "model": ("model", "Write the walking model of a patient as a URDF."),
    "export": (
        "export",
        "Write a run for other programs: tables, or an OpenSim model with its set-up.",
    ),
    "import": ("recorded", "Turn C3D files into joint angles, events and forces."),
    "ik": ("recorded", "Compute joint angles from the markers of C3D files."),
    "id": ("recorded", "Compute joint torques and muscle strengths from recorded gait."),
    "init": (
        "init",
        "Write a folder for a new child: patient, orthosis and configs that explain themselves.",
    ),
    "check": (
        "check",
        "Check configs, patients and marker sets, and say what would be solved; nothing is solved.",
    ),
    "completion": (
        "complete",
        "Print the script that completes commands, options, configs, problems and runs in SHELL.",
    ),
    "doctor": ("doctor", "Check that everything PathWalker needs is there and works."),
}
"""Module and first line of help of every command: listing them imports none."""


GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "Predict": ("solve", "batch", "reproduce"),
    "Springs and certainty": tuple(STUDIES),
    "Recorded gait": ("import", "ik", "id"),
    "Look and compare": (
        "report",
        "animate",
        "explore",
        "view",
        "compare",
        "evaluate",
        "model",
        "export",
    ),
    "Prove": ("verify", "rerun"),
    "Set up": ("init", "check", "doctor", "completion"),
}
"""Commands by what they are for, in the order of the help."""


_MENDS: Final = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT), "; make room, then call again"),
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), "; choose another place"),
}
"""What to do about errors of the disk that nobody foresaw where they arose."""


class _LazyGroup(click.Group):
    """Imports a command when it is called, and is the one place where errors become exit codes."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"pathwalker_cli.commands.{COMMANDS[cmd_name][0]}")
        command: click.Command = (
            module.study_command(cmd_name)
            if cmd_name in STUDIES
            else getattr(module, f"{cmd_name}_command")
        )
        command.epilog = examples_epilog(cmd_name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"there is no command '{args[0]}'; allowed: {', '.join(COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        grouped = {name for names in GROUPS.values() for name in names}
        others = tuple(name for name in COMMANDS if name not in grouped)
        width = max(map(len, COMMANDS))
        for heading, names in {**GROUPS, "Others": others}.items():
            if names:
                with formatter.section(heading):
                    rows = [(f"{name:<{width}}", COMMANDS[name][1]) for name in names]
                    formatter.write_dl(rows)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with _stoppable() as stopped:
                return super().invoke(ctx)
        except PathwalkerError as error:
            code = NOT_CONVERGED if isinstance(error, NotConvergedError) else REFUSED
            if code == NOT_CONVERGED:
                print_failure(ctx, str(error))
            _fail(ctx, str(error), code)
        except BrokenPipeError:
            raise  # who reads the output went away: click ends quietly
        except OSError as problem:
            place = f"{problem.filename}: " if problem.filename else ""
            mend = _MENDS.get(problem.errno or 0, "")
            _fail(ctx, f"{place}{problem.strerror or problem}{mend}", REFUSED)
        except KeyboardInterrupt:
            _fail(ctx, STOPPED_TEXT, STOPPED)
        except Exception:
            if not stopped:
                raise
            _fail(ctx, STOPPED_TEXT, STOPPED)  # libraries make errors of their own out of Ctrl-C


@contextmanager
def _stoppable() -> Iterator[list[int]]:
    """Let Ctrl-C end a command in order, and a second one end the process at once.

    Yields:
        What is empty until then.
    """
    stopped: list[int] = []

    def stop(number: int, _: object) -> None:
        stopped.append(number)
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        raise KeyboardInterrupt

    # a command that runs in the background does not hear it, and only the main thread may ask
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield stopped
        return
    signal.signal(signal.SIGINT, stop)
    try:
        yield stopped
    finally:
        if not stopped:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _fail(ctx: click.Context, sentence: str, code: int) -> NoReturn:
    """Say one sentence on stderr and exit."""
    click.echo(f"Error: {sentence}", err=True)
    ctx.exit(code)


@click.group(
    cls=_LazyGroup,
    epilog="Start with: pathwalker init my-child",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="pathwalker")
def cli() -> None:
    """Predict how a child walks with and without ankle-foot orthoses, by optimal control."""


def main() -> None:
    """Run the command line; the entry point of `pathwalker`."""
    cli.main(prog_name="pathwalker")
