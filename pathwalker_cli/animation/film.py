"""The animation as a film: GIF or MP4."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from subprocess import CalledProcessError
from tempfile import TemporaryDirectory
from textwrap import fill, shorten
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.text import Text
from matplotlib.ticker import FormatStrFormatter, MultipleLocator

from pathwalker_cli.animation.drawing import Drawing, View, common_view, drawing, force_scale, words
from pathwalker_cli.animation.frames import GaitFrames
from pathwalker_cli.animation.look import (
    ACTIVATION_COLOURS,
    CAVEAT,
    DASHES,
    SHADOW_COLOUR,
    SHELL_COLOUR,
    SPRING_COLOUR,
    Look,
    arrow_look,
    pace,
    recorded_name,
    shape_look,
    subtitle,
)
from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.atomic import output_path
from pathwalker_cli.stride.figures.style import BODY_COLOUR, FORCE_COLOUR, STYLE

MOST_FRAMES: Final = 3000
"""Frames of the longest film: a GIF is put together in memory."""

_DPI: Final = 100
_PANEL: Final = 5.4
_GAP: Final = 0.2
"""Width of the picture of one stride, and what is free beside it [in]."""
_HEADER: Final = 0.7
_FOOTER: Final = 0.85
"""Heights of the lines above and below the pictures [in]."""
_LINE: Final = 92
"""Characters of the longest line above a picture."""
_COLOURS: Final = LinearSegmentedColormap.from_list("activation", ACTIVATION_COLOURS)


def film_rate(path: Path, wanted: float) -> float:
    """Return the frames per second [1/s] that a film can have, next to those that are wanted.

    A GIF shows every frame for whole hundredths of a second.
    """
    return 100.0 / max(1, round(100.0 / wanted)) if path.suffix.lower() == ".gif" else wanted


def write_film(path: Path, runs: Sequence[GaitFrames], strides: int, rate: float) -> None:
    """Write a film of one or two strides with a frame for each of their instants, in one stroke.

    Args:
        path: The file, .gif or .mp4.
        runs: The strides, at the same number of instants.
        strides: How often they are walked.
        rate: Frames per second, from `film_rate` [1/s].

    Raises:
        DataError: If the film is too long, there is no program that makes MP4 or it fails, or the
            file cannot be written.
    """
    count = strides * runs[0].count
    if count > MOST_FRAMES:
        raise DataError(
            f"would have {count} frames",
            where=str(path),
            allowed=f"at most {MOST_FRAMES}",
            mend="choose a smaller --strides, --fps or --slow",
        )
    kind = path.suffix.lower()
    slow = runs[0].count / (rate * runs[0].duration)
    with mpl.rc_context(STYLE), _writer(kind, rate) as writer, TemporaryDirectory() as folder:
        made = Path(folder) / f"film{kind}"
        figure, panels = _figure([drawing(frames) for frames in runs], slow)
        with writer.saving(figure, str(made), _DPI):
            for k in range(count):
                for panel in panels:
                    panel.show(k)
                writer.grab_frame()
        with output_path(path) as temporary:
            shutil.copyfile(made, temporary)


@contextmanager
def _writer(kind: str, rate: float) -> Iterator[AbstractMovieWriter]:
    """Yield what puts frames together."""
    if kind == ".gif":
        # It cuts 1000 / rate to whole milliseconds, where 29.999 would become 20.
        yield PillowWriter(fps=rate * (1.0 - 1e-9))  # type: ignore[arg-type]
        return
    with mpl.rc_context({"animation.ffmpeg_path": _ffmpeg()}):
        try:
            yield FFMpegWriter(fps=rate, codec="h264")  # type: ignore[arg-type]
        except (CalledProcessError, BrokenPipeError):
            raise DataError(
                f"{_ffmpeg()} could not make the film",
                allowed="an ffmpeg that encodes H.264",
                mend="run: pip install imageio-ffmpeg; or write a .gif",
            ) from None


def _ffmpeg() -> str:
    """Return the ffmpeg of the system, or else the one that pip installed."""
    program = shutil.which("ffmpeg")
    if program is not None:
        return program
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise DataError(
            "MP4 needs ffmpeg, which is not there",
            mend="run: pip install imageio-ffmpeg; or write a .gif or .html",
        ) from None


@dataclass(frozen=True)
class _Panel:
    """The picture of one stride, whose artists move from frame to frame."""

    stride: Drawing
    view: View
    axes: Axes
    shapes: tuple[Polygon, ...]
    arrows: tuple[Polygon, ...]
    now: tuple[Text, ...]

    def show(self, k: int) -> None:
        """Move everything to frame k, counted over all strides."""
        frames = self.stride.frames
        strides, i = divmod(k, frames.count)
        walked = np.array([strides * frames.distance, 0.0])
        for shape, artist in zip(self.stride.shapes, self.shapes, strict=True):
            artist.set_xy(shape.at(self.stride.points, i) + walked)
            if shape.generator is not None:
                artist.set_facecolor(_COLOURS(frames.activation[i, shape.generator]))
        for side, artist in zip(SIDES, self.arrows, strict=True):
            arrow = self.stride.arrows[side][i]
            artist.set_visible(bool(np.isfinite(arrow).all()))
            if artist.get_visible():
                artist.set_xy(arrow + walked)
        cycle = frames.cycle[i]
        eye = frames.middle + cycle * frames.distance + walked[0]
        self.axes.set_xlim(eye - self.view.half_width, eye + self.view.half_width)
        texts = (
            words(frames.phase[i]),
            f"{cycle * frames.duration:.2f} s",
            f"{100.0 * cycle:.0f} % of right gait cycle",
        )
        for text, line in zip(texts, self.now, strict=True):
            line.set_text(text)


def _figure(drawings: Sequence[Drawing], slow: float) -> tuple[Figure, list[_Panel]]:
    """Return the figure with a picture for every stride, beside each other."""
    view = common_view(drawings)
    shape = (view.top - view.bottom) / (2.0 * view.half_width)
    width, height = (_PANEL + _GAP) * len(drawings), _PANEL * shape + _HEADER + _FOOTER
    pixels = [2 * round(size * _DPI / 2) for size in (width, height)]  # even, as H.264 demands
    figure = Figure(figsize=(pixels[0] / _DPI, pixels[1] / _DPI))
    panels = []
    for k, each in enumerate(drawings):
        edge = k * (_PANEL + _GAP) + _GAP / 2
        place = (edge / width, _FOOTER / height, _PANEL / width, _PANEL * shape / height)
        panels.append(_panel(figure.add_axes(place), each, view))
    _legend(figure, drawings, width, height)
    lines = [pace([each.frames for each in drawings]), CAVEAT]
    if behind := recorded_name([each.frames for each in drawings]):
        lines.insert(1, f"Behind: {behind}.")
    if abs(slow - 1.0) >= 0.02:
        lines.insert(1, f"The film takes {slow:.2f} times as long as the walk.")
    caption = fill(" ".join(line for line in lines if line), round(15 * width))
    figure.text(0.12 / width, 0.06 / height, caption, va="bottom", parse_math=False, fontsize=7)
    return figure, panels


def _panel(axes: Axes, each: Drawing, view: View) -> _Panel:
    """Return the picture of a stride with artists that have no place yet."""
    frames = each.frames
    axes.set_ylim(view.bottom, view.top)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.spines["bottom"].set_position(("data", 0.0))
    axes.yaxis.set_visible(False)
    axes.xaxis.set_major_locator(MultipleLocator(0.5))
    axes.xaxis.set_minor_locator(MultipleLocator(0.1))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%.1f m"))
    axes.tick_params(which="major", length=7)
    axes.tick_params(which="minor", length=3)
    inch = _PANEL / (2.0 * view.half_width)
    high = inch * (view.top - view.bottom)
    head: dict[str, Any] = {"transform": axes.transAxes, "parse_math": False, "va": "top"}
    name = shorten(frames.name, _LINE // 2, placeholder=" ...")
    axes.text(0.02, 1.0 + 0.62 / high, name, fontsize=11, fontweight="bold", **head)
    notes = "".join(f" Note: {note}." for note in frames.notes)
    axes.text(0.02, 1.0 + 0.38 / high, fill(subtitle(frames) + notes, _LINE), fontsize=8, **head)
    now = [axes.text(x, 0.19 / high, "", fontsize=10, **head) for x in (0.02, 0.38, 0.52)]
    now[0].set_fontweight("bold")
    weight = force_scale(frames) * frames.weight
    place, top = axes.get_yaxis_transform(), view.top - 0.05
    bar: dict[str, Any] = {"color": FORCE_COLOUR, "linewidth": 1.5, "marker": "_"}
    axes.plot([0.03, 0.03], [top - weight, top], transform=place, **bar)
    told = f"force of 1 body weight,\n{frames.weight:.0f} N"
    axes.text(0.05, top, told, transform=place, va="top", fontsize=8)
    looks = [(shape_look(shape), shape.closed) for shape in each.shapes]
    arrows = [arrow_look(side) for side in SIDES]
    return _Panel(
        stride=each,
        view=view,
        axes=axes,
        shapes=tuple(_artist(axes, look, closed, inch, 3) for look, closed in looks),
        arrows=tuple(_artist(axes, look, True, inch, 4) for look in arrows),
        now=tuple(now),
    )


def _artist(axes: Axes, look: Look, closed: bool, inch: float, order: int) -> Polygon:
    """Return a polygon in a look; a metre is `inch` inches long."""
    points = 72.0 * inch
    dashes = (0.0, tuple(length / look.width for length in DASHES))
    artist = Polygon(
        np.zeros((2, 2)),
        closed=closed,
        facecolor="none" if look.fill == "none" else (look.fill, look.opacity),
        edgecolor=look.stroke,
        linewidth=look.width * points,
        linestyle=dashes if look.dashed else "-",
        joinstyle="round",
        capstyle="butt" if look.dashed else "round",
        zorder=order,
    )
    axes.add_patch(artist)
    return artist


def _legend(figure: Figure, drawings: Sequence[Drawing], width: float, height: float) -> None:
    """Draw the legend and the scale of activations below the pictures."""
    handles: list[Artist] = [
        Line2D([], [], color=BODY_COLOUR["right"], linewidth=3, label="right leg"),
        Line2D([], [], color=BODY_COLOUR["left"], linewidth=3, linestyle="--", label="left leg"),
        Patch(facecolor=FORCE_COLOUR, edgecolor=FORCE_COLOUR, label="ground force, right"),
        Patch(facecolor="#ffffff", edgecolor=FORCE_COLOUR, label="left"),
    ]
    if any(each.frames.braced for each in drawings):
        shell = (SHELL_COLOUR, 0.45)
        handles.append(Patch(facecolor=shell, edgecolor=SPRING_COLOUR, label="orthosis"))
    if any(each.frames.recorded for each in drawings):
        handles.append(Line2D([], [], color=SHADOW_COLOUR, linewidth=2, label="recorded"))
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 0.4 / height),
                  ncols=len(handles), frameon=False, columnspacing=1.0,
                  handlelength=2.2)  # fmt: skip
    scale = figure.add_axes((1.0 - 1.25 / width, 0.62 / height, 1.0 / width, 0.1 / height))
    colours = ScalarMappable(cmap=_COLOURS)
    figure.colorbar(colours, cax=scale, orientation="horizontal", ticks=[0, 1])
    scale.set_title("muscle activation", fontsize=7, pad=2)
    scale.tick_params(length=0, labelsize=7, pad=1)
