"""The command `report`: one page instead of many files."""

from __future__ import annotations

import os
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from pathwalker_cli.commands.complete import complete_runs
from pathwalker_cli.commands.options import out_option, runs_argument

if TYPE_CHECKING:
    from pathwalker_cli.animation.html import Video


@click.command("report")
@runs_argument()
@out_option("The page; an earlier one is replaced.", "-o", metavar="FILE.html")
@click.option(
    "--pdf",
    type=click.Path(path_type=Path),
    metavar="FILE.pdf",
    help="The same page as a PDF file, for A4.",
)
def report_command(runs: tuple[Path, ...], out: Path | None, pdf: Path | None) -> None:
    """Write one self-contained HTML page about RUN folders, a PDF file, or both.

    Runs of one patient, barefoot and with orthoses, stand side by side; folders of perturb,
    sensitivity and landscape among RUN, inside or beside a run add their tables. Folders that id
    or batch wrote give a page of their own, of any number of patients. A run that did not converge
    is refused, except in a cohort, where it is shown as failed.
    """
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.io.atomic import atomic_open, check_output, write_text
    from pathwalker_cli.report.page import page_html, page_of

    if out is None and pdf is None:
        raise DataError("names no file", where="report", mend="add -o FILE.html or --pdf FILE.pdf")
    for option, file, endings in (("--out", out, (".html", ".htm")), ("--pdf", pdf, (".pdf",))):
        if file is not None:
            if file.suffix not in endings:
                what, allowed = "is no name of such a page", f"FILE{endings[0]}"
                raise DataError(what, where=f"{option} {file}", allowed=allowed)
            check_output(file)
    page = page_of(runs)
    if out is not None:
        write_text(out, page_html(page))
        click.echo(f"Written to {out}")
    if pdf is not None:
        from pathwalker_cli.report.pdf import page_pdf

        with atomic_open(pdf, "wb") as written:
            written.write(page_pdf(page))
        click.echo(f"Written to {pdf}")


_PAGE, _FILMS = ".html", (".gif", ".mp4")


@click.command("animate")
@runs_argument("RUN [RUN]")
@out_option("File: .html, .gif or .mp4.", "-o", required=True, metavar="FILE")
@click.option(
    "--strides", type=click.IntRange(1, 100), metavar="N", help="Strides of a film; 1 if left out."
)
@click.option(
    "--fps",
    type=click.IntRange(1, 60),
    metavar="RATE",
    help="Pictures per second of a film; 25 if left out.",
)
@click.option(
    "--slow",
    type=click.FloatRange(0.1, 100.0),
    metavar="FACTOR",
    help="How many times as long as the walk a film takes; 1 if left out.",
)
@click.option(
    "--recorded",
    metavar="TRIAL",
    help="Draw a recorded gait cycle behind the first run: a C3D file with markers, or the name of "
    "a recording of the patient.",
)
@click.option(
    "--video",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Show a video of the child beside the walker; a page only, which finds it by its place.",
)
@click.option(
    "--video-start",
    type=click.FloatRange(0.0, 36000.0),
    metavar="SECONDS",
    help="When the right heel strikes the ground in the video; 0 if left out.",
)
def animate_command(
    runs: tuple[Path, ...],
    out: Path,
    strides: int | None,
    fps: int | None,
    slow: float | None,
    recorded: str | None,
    video: Path | None,
    video_start: float | None,
) -> None:
    """Draw the walker of one run, or of two side by side, as it walks.

    An .html file plays in any browser without a network, at full, half or quarter speed; a .gif or
    .mp4 is a film. MP4 needs ffmpeg: that of the system, or pip install imageio-ffmpeg. Body,
    ground forces, orthosis and muscle activations are drawn; a recorded cycle is drawn behind them
    at the same share of the gait cycle. A run that did not converge is refused.
    """
    from pathwalker_cli.animation.frames import run_frames

    _check(runs, out, {"--strides": strides, "--fps": fps, "--slow": slow})
    _check_video(out, video, video_start)
    if out.suffix.lower() == _PAGE:
        from pathwalker_cli.animation.html import RATE, html_page
        from pathwalker_cli.io.atomic import write_text

        beside = _video(video, video_start, out)
        write_text(out, html_page(run_frames(runs, RATE, recorded), beside))
    else:
        from pathwalker_cli.animation.film import film_rate, write_film

        rate = film_rate(out, fps or 25)
        frames = run_frames(runs, rate * (slow or 1.0), recorded)
        write_film(out, frames, strides or 1, rate)
    click.echo(f"Written to {out}")


def _check(runs: tuple[Path, ...], out: Path, options: dict[str, float | None]) -> None:
    """Refuse what no animation can be made of, before anything is computed."""
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.io.atomic import check_output

    if len(runs) > 2:
        raise DataError(f"{len(runs)} runs are named", where="animate", allowed="one or two runs")
    if out.suffix.lower() not in (_PAGE, *_FILMS):
        raise DataError(
            "is no kind of animation", where=str(out), allowed=", ".join((_PAGE, *_FILMS))
        )
    if isnan(options["--slow"] or 1.0):
        raise DataError("is not a number", where="--slow", allowed="from 0.1 to 100")
    given = [name for name, value in options.items() if value is not None]
    if given and out.suffix.lower() == _PAGE:
        raise DataError(
            "is about films only; a page has its own speed and goes on until it is paused",
            where=given[0],
            allowed="with " + " and ".join(_FILMS),
            mend=f"leave {given[0]} out",
        )
    check_output(out)


_VIDEOS: Final = (".mp4", ".m4v", ".mov", ".webm", ".ogv")
"""Kinds of videos that browsers show."""


def _check_video(out: Path, video: Path | None, start: float | None) -> None:
    """Refuse a video that no page can show."""
    from pathwalker_cli.errors import DataError

    if video is None:
        if start is not None:
            raise DataError("says when, but of no video", where="--video-start",
                            mend="add --video FILE")  # fmt: skip
        return
    if out.suffix.lower() != _PAGE:
        raise DataError("is shown by pages only", where=f"--video {video}", allowed=f"with {_PAGE}")
    if video.suffix.lower() not in _VIDEOS:
        raise DataError("is no kind of video that browsers show", where=f"--video {video}",
                        allowed=", ".join(_VIDEOS))  # fmt: skip
    if not video.is_file():
        raise DataError("no such file", where=f"--video {video}")


def _video(video: Path | None, start: float | None, page: Path) -> Video | None:
    """Return a video as a page finds it from its own place."""
    if video is None:
        return None
    from urllib.parse import quote

    from pathwalker_cli.animation.html import Video

    place = os.path.relpath(video.resolve(), page.resolve().parent)
    return Video(quote(place), start or 0.0)


@click.command("view")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@click.option(
    "--strides",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Strides to play; until Ctrl-C if left out.",
)
@click.option("--no-open", is_flag=True, help="Print the address only, open no browser.")
def view_command(run: Path, strides: int | None, no_open: bool) -> None:
    """Show the stride of RUN in 3D in a browser, in real time, until Ctrl-C.

    The walker moves on the spot, as on a treadmill. Needs MeshCat: pip install meshcat. A run that
    did not converge is refused.
    """
    from pathwalker_cli.animation.viewer import open_viewer, show
    from pathwalker_cli.evaluation.run import stride_of_run

    _, series = stride_of_run(run)
    viewer = open_viewer(series.walker)
    click.echo(f"{run} at {viewer.viewer.url()}; Ctrl-C ends it")
    if not no_open:
        viewer.viewer.open()
    try:
        show(viewer, series, strides)
    except KeyboardInterrupt:
        click.echo()
