"""Run the commands of `tutorial.md` in an empty folder and write what they print into the page.

python docs/tutorial/record.py            # run everything and fill the page
python docs/tutorial/record.py --blank    # leave the commands only

A place in the page begins with `<!-- OUTPUT: command -->` or `<!-- PICTURE: file | caption -->` and
ends with `<!-- END -->`; what stands between is written by this script.
`<!-- OUTPUT (first 4, last 20): command -->` keeps some lines, `(exit 1)` says that the command is
meant to fail. Commands run one after the other in the same folder.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

PAGE: Final = Path(__file__).parent.with_name("tutorial.md")
PICTURES: Final = Path(__file__).parent

_PLACE: Final = re.compile(
    r"^(?P<indent> *)(?P<head><!-- (?P<kind>OUTPUT|PICTURE)"
    r"(?: \((?P<options>[^)]*)\))?: (?P<what>.*?) -->)\n"
    r"(?:.*?\n)?? *<!-- END -->$",
    re.MULTILINE | re.DOTALL,
)
_WIDTH: Final = 100


@dataclass(frozen=True)
class Printed:
    """What a command printed.

    Args:
        lines: The lines, standard output and error together.
        seconds: Wall time [s]; None if it was not run.
    """

    lines: tuple[str, ...] = ()
    seconds: float | None = None


Run = Callable[[str, int], Printed]
"""Runs a command that is expected to end with an exit code."""
Fetch = Callable[[str], str | None]
"""Returns the place of a picture relative to the page, None where there is none."""


def filled(page: str, run: Run, fetch: Fetch) -> str:
    """Return the page with all places filled, in their order."""

    def place(found: re.Match[str]) -> str:
        options, what = dict(_options(found["options"] or "")), found["what"]
        if found["kind"] == "OUTPUT":
            lines = _block(what, run(what, options.get("exit", 0)), options)
        else:
            file, _, caption = what.partition(" | ")
            target = fetch(file)
            lines = ["", f"![{caption}]({target})", ""] if target else []
        text = "\n".join([found["head"], *lines, "<!-- END -->"])
        return "\n".join(f"{found['indent']}{line}".rstrip() for line in text.split("\n"))

    return _PLACE.sub(place, page)


def commands(page: str) -> tuple[str, ...]:
    """Return the commands of a page in their order."""
    return tuple(found["what"] for found in _PLACE.finditer(page) if found["kind"] == "OUTPUT")


def blank(page: str) -> str:
    """Return the page with commands but without what they print."""
    return filled(page, lambda command, code: Printed(), lambda file: None)


def _options(text: str) -> list[tuple[str, int]]:
    """Return options such as "first 4, last 20" as names and numbers."""
    pairs = (part.split() for part in text.split(",") if part.strip())
    return [(name, int(number)) for name, number in pairs]


def _block(command: str, printed: Printed, options: dict[str, int]) -> list[str]:
    """Return a command and what it printed as Markdown."""
    shown = _trimmed(printed.lines, options.get("first", 0), options.get("last", 0))
    block = ["", "```console", f"$ {command}", *shown, "```", ""]
    if printed.seconds is not None and printed.seconds >= 1.0:
        block += [f"*This took {printed.seconds:.0f} s.*", ""]
    return block


def _trimmed(lines: tuple[str, ...], first: int, last: int) -> tuple[str, ...]:
    """Return the first and the last lines; all of them if no number is given."""
    if not (first or last) or len(lines) <= first + last:
        return lines
    return (*lines[:first], "...", *(lines[-last:] if last else ()))


class Recorder:
    """Runs commands in a folder and fetches pictures from it.

    Args:
        folder: The folder, empty at first.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        self._environment = {
            **os.environ,
            "PATH": programs,
            "COLUMNS": str(_WIDTH),
            "NO_COLOR": "1",
        }

    def run(self, command: str, code: int) -> Printed:
        """Run a command; another exit code than the expected one ends the script."""
        print(f"$ {command}", file=sys.stderr, flush=True)
        began = time.perf_counter()
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        if done.returncode != code:
            tail = "\n".join(done.stdout.splitlines()[-20:])
            sys.exit(f"{tail}\n{command}: exit code {done.returncode} instead of {code}")
        text = done.stdout.replace(f"{self.folder}/", "").replace(str(self.folder), ".")
        text = text.replace(str(Path.home()), "~")
        lines = tuple(line.rstrip() for line in text.strip("\n").splitlines())
        return Printed(lines, time.perf_counter() - began)

    def fetch(self, file: str) -> str:
        """Copy a picture beside this script."""
        target = PICTURES / Path(file).name
        shutil.copyfile(self.folder / file, target)
        return f"{PICTURES.name}/{target.name}"


def main() -> None:
    """Fill the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--blank", action="store_true", help="leave the commands only")
    page = PAGE.read_text(encoding="utf-8")
    if parser.parse_args().blank:
        PAGE.write_text(blank(page), encoding="utf-8")
        return
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(Path(folder).resolve())
        text = filled(page, recorder.run, recorder.fetch)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
