"""`fingervision model --modes`: natural frequencies, with plots and a film of the mode shapes."""

import textwrap
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import ceil, cos, pi
from pathlib import Path
from typing import Any

import av
import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from fingervision.domain.errors import OutputError
from fingervision.models.kinds import by_trust
from fingervision.models.mode_shapes import ModeShape
from fingervision.storage.row_file import write_table

_A_ROW = 6
_PICTURES, _PERIODS, _A_SECOND = 24, 4, 24
"""Pictures per period, periods in the film, and pictures per second: one period takes one second for every
frequency."""
_FILM_DPI = 80
_LETTERS_AN_INCH = 12.0
"""Letters of a title that fit side by side."""
_KILO = 1e4
"""Frequency (Hz) from which a title states kHz: with four digits, Hz would be printed as a power of ten."""
_MARGIN = 0.02
_MOST_FILM_MODES = 18


def write_modes(found: Mapping[str, Sequence[ModeShape]], name: str, out: Path, *, film: bool, as_json: bool) -> None:
    """Write modes.csv, modes.png and, if requested, modes.mp4."""
    rows = [(kind, s.family, s.number, s.frequency_hz) for kind, shapes in found.items() for s in shapes]
    write_table(out / "modes.csv", ("kind", "family", "number", "frequency_hz"), rows, digits=7)
    for kind, shapes in found.items():
        for family in dict.fromkeys(s.family for s in shapes):
            values = ", ".join(f"{s.frequency_hz:.5g}" for s in shapes if s.family == family)
            if not as_json:
                click.echo(f"{kind}, {family}: {values} Hz")
    drawn = next((found[kind] for kind in by_trust(found)), ())
    if not drawn:
        click.echo("No natural mode lies in the range that --modes states: no picture is drawn.", err=True)
        return
    title = f"{name}: natural modes in the plane, without the actuator's mass, arbitrary amplitudes"
    figure, _ = _panels(drawn, title)
    figure.savefig(out / "modes.png", dpi=110)
    if film:
        _film(drawn[:_MOST_FILM_MODES], title, out / "modes.mp4")
        if len(drawn) > _MOST_FILM_MODES and not as_json:
            click.echo(f"modes.mp4 shows the first {_MOST_FILM_MODES} of {len(drawn)} modes.")


def _panels(shapes: Sequence[ModeShape], title: str) -> tuple[Figure, list[tuple[Axes, LineCollection, ModeShape]]]:
    """Plot every mode in its own panel, one row per family of modes; return the plotted lines to be animated."""
    families = [[s for s in shapes if s.family == f] for f in dict.fromkeys(s.family for s in shapes)]
    columns = min(_A_ROW, max(map(len, families)))
    if columns == 1:
        families, columns = [list(shapes)], min(_A_ROW, len(shapes))
    rows = [family[i : i + columns] for family in families for i in range(0, len(family), columns)]
    every = np.concatenate([(s.lines_mm + sign * s.shift_mm).reshape(-1, 2) for s in shapes for sign in (-1.0, 1.0)])
    margin = _MARGIN * float(np.ptp(every, axis=0).max())
    low, high = every.min(axis=0) - margin, every.max(axis=0) + margin
    ratio = float((high[1] - low[1]) / (high[0] - low[0]))
    width = 2.6 if ratio > 0.4 else 3.4
    figure = Figure(figsize=(max(width * columns, 5.0) + 0.6, (width * ratio + 0.9) * len(rows) + 0.5),
                    layout="constrained")  # fmt: skip
    figure.suptitle(textwrap.fill(title, int(_LETTERS_AN_INCH * figure.get_size_inches()[0])), fontsize="medium")
    grid = figure.subplots(len(rows), columns, squeeze=False)
    moving = []
    for place, row in enumerate(rows):
        for axes, shape in zip(grid[place], [*row, *[None] * (columns - len(row))], strict=True):
            if shape is None:
                axes.set_axis_off()
                continue
            axes.add_collection(LineCollection(list(shape.lines_mm), colors="0.75", linewidths=0.8))
            curve = LineCollection(list(shape.lines_mm + shape.shift_mm), colors="C0", linewidths=1.0)
            axes.add_collection(curve)
            axes.set_xlim(low[0], high[0])
            axes.set_ylim(low[1], high[1])
            axes.set_aspect("equal")
            axes.set_title(f"{shape.family}\n{shape.number}: {_in_hz(shape.frequency_hz)}", fontsize="small")
            axes.tick_params(labelsize="x-small")
            axes.set_xlabel("x / mm", fontsize="x-small")
            moving.append((axes, curve, shape))
        grid[place][0].set_ylabel("y / mm", fontsize="x-small")
    return figure, moving


def _in_hz(frequency_hz: float) -> str:
    return f"{frequency_hz:.4g} Hz" if frequency_hz < _KILO else f"{1e-3 * frequency_hz:.4g} kHz"


def _film(shapes: Sequence[ModeShape], title: str, path: Path) -> None:
    """Write a film of every mode vibrating with a period of one second, side by side."""
    figure, moving = _panels(shapes, f"{title}; slowed to one oscillation per second")
    # H.264 with subsampled colour needs an even width and height.
    sides = [2 * ceil(side * _FILM_DPI / 2) / _FILM_DPI for side in figure.get_size_inches()]
    figure.set_size_inches(sides[0], sides[1])
    figure.set_dpi(_FILM_DPI)
    canvas: Any = FigureCanvasAgg(figure)
    for _, curve, _ in moving:
        curve.set_visible(False)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    pictures = []
    for picture in range(_PICTURES):
        canvas.restore_region(still)
        swing = cos(2.0 * pi * picture / _PICTURES)
        for axes, curve, shape in moving:
            curve.set_visible(True)
            curve.set_segments(list(shape.lines_mm + swing * shape.swing * shape.shift_mm))
            axes.draw_artist(curve)
        pictures.append(np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]))
    try:
        with av.open(f"file:{path}", "w") as container:
            stream = container.add_stream("libx264", rate=_A_SECOND, options={"crf": "20", "preset": "veryfast"})
            stream.height, stream.width = pictures[0].shape[:2]
            stream.pix_fmt = "yuv420p"
            for place in range(_PERIODS * _PICTURES):
                frame = av.VideoFrame.from_ndarray(pictures[place % _PICTURES], format="rgb24")
                frame.pts, frame.time_base = place, Fraction(1, _A_SECOND)
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
    except (av.FFmpegError, OSError) as error:
        raise OutputError(f"The film of the modes could not be written to {path}: {error}.") from error
