"""`fingervision model --frequency`, `--modes`: response to a vibrating drive, and natural modes with film."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, cos, isfinite, pi
from pathlib import Path
from typing import Any

import av
import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from fingervision.cli._model_figures import save_figure
from fingervision.domain.errors import OutputError, UsageError
from fingervision.models.damping import parse_damping
from fingervision.models.kinds import by_trust
from fingervision.models.modal_model import (
    GAP,
    FreeModes,
    FrequencyResponse,
    ModalModel,
    described,
    frequency_response,
    resolved_frequencies_hz,
)
from fingervision.models.mode_shapes import ModeShape
from fingervision.models.motion_in_time import MODES
from fingervision.storage.row_file import write_table

_MOST_MODES = 60
_LEAST_PEAK = 0.01
"""Least rise of a peak that is told, as a share of the response: a probe at the drive moves as the drive does."""
_LEAST_RANGE, _LEAST_DEG = 1.1, 1.0
"""Least range of the axes, as a ratio and in degrees."""
_STYLES = ("-", "--", "-.")


@dataclass(frozen=True, slots=True)
class Band:
    """A band of frequencies, with its lower and upper limit in Hz."""

    first_hz: float
    last_hz: float


def parse_band(text: str) -> Band:
    """Read a frequency band `A:B` in Hz.

    Raises
    ------
    UsageError
        The text is not a frequency band.
    """
    try:
        first, last = (float(part) for part in text.split(":"))
    except ValueError:
        first, last = 0.0, 0.0
    if not (isfinite(first) and isfinite(last) and 0.0 < first < last):
        raise UsageError(
            f"--frequency must be A:B, two positive frequencies in Hz with A below B, such as 1:500, but is {text}."
        )
    return Band(first, last)


def answer_frequencies(
    models: Mapping[str, Any], band: Band, damping: str, name: str, out: Path, *, as_json: bool
) -> None:
    """Write the frequency response of every kind of model with masses to frequency.csv and frequency.png."""
    found: dict[str, FrequencyResponse] = {}
    main = ""
    for kind, model in moving(models, "frequency response", as_json=as_json).items():
        reduced = _modes_to(model.modal_model, 2.0 * band.last_hz)
        main = main or main_column(reduced, name)
        found[kind] = _respond_to(reduced, model.free_modes(reduced.rad_s.size), band, damping)
    if not found:
        raise UsageError(
            "--frequency needs a kind of model that has masses, lumped or finite_element, but none is chosen "
            "with --kind."
        )
    _write_frequencies(found, out / "frequency.csv")
    _draw_frequencies(found, main, f"{name}, damping {damping}", out / "frequency.png")
    if not as_json:
        for kind, answer in found.items():
            click.echo(f"{kind}: {_peaks_of(answer, main)}")


def moving(models: Mapping[str, Any], what: str, *, as_json: bool) -> dict[str, Any]:
    """Models that have masses in the plane; the others are named."""
    found = {kind: model for kind, model in models.items() if hasattr(model, "modal_model")}
    if not as_json:
        for kind in models:
            if kind not in found:
                click.echo(f"{kind} has no masses in the plane, and therefore no {what}.")
    return found


def _modes_to(reduce: Callable[[int], ModalModel], highest_hz: float) -> ModalModel:
    """Compute the modes below a frequency, and the next mode above it."""
    count = MODES
    while True:
        reduced = reduce(count)
        if reduced.modes_hz[-1] > highest_hz or count >= _MOST_MODES:
            break
        count = min(2 * count, _MOST_MODES)
    if reduced.modes_hz[-1] < 0.5 * highest_hz:
        raise UsageError(
            f"--frequency must end within the first {count} modes, below {reduced.modes_hz[-1]:.4g} Hz, but ends at "
            f"{0.5 * highest_hz:.4g} Hz."
        )
    return reduced


def _respond_to(reduced: ModalModel, free: FreeModes, band: Band, damping: str) -> FrequencyResponse:
    """Compute the response over a frequency band, with closely spaced frequencies around every resonance."""
    law = parse_damping(damping)
    for rad_s in (reduced.rad_s, free.rad_s):
        known = described(law, rad_s).size
        if known < rad_s.size and rad_s[known] / (2.0 * pi) < band.last_hz:
            raise UsageError(
                f"--damping {damping} is valid for modes up to {rad_s[known - 1] / (2.0 * pi):.4g} Hz only (beyond, "
                f"the damping ratio is outside 0 to 0.3), but --frequency goes to {band.last_hz:g} Hz and includes "
                f"the mode at {rad_s[known] / (2.0 * pi):.4g} Hz: end the band below this mode, or use --damping "
                "modal:0.025."
            )
    frequencies = resolved_frequencies_hz(reduced, free, law, band.first_hz, band.last_hz)
    return frequency_response(reduced, free, frequencies, law)


def _peaks_of(answer: FrequencyResponse, column: str) -> str:
    """Sentence on the frequencies of resonance, with the drive's motion prescribed and with the drive free."""
    words = []
    for what, curve in (
        ("per input", answer.per_input[column]), ("per force", answer.per_force_mm_n[column]),
    ):  # fmt: skip
        size = np.abs(curve)
        unit = "mm/mm" if what == "per input" else "mm/N"
        at, _ = find_peaks(np.log(size), prominence=_LEAST_PEAK)
        tops = ", ".join(f"{size[i]:.4g} {unit} at {answer.frequency_hz[i]:.4g} Hz" for i in at[:4]) or "no peak"
        words.append(f"{column.removesuffix('_mm')} {what}: {tops}")
    return "; ".join(words)


def _write_frequencies(found: Mapping[str, FrequencyResponse], path: Path) -> None:
    """Write amplitude and phase of every length per unit input and per unit force, and of the drive per unit force."""
    columns, header = tuple(next(iter(found.values())).per_input), ["kind", "frequency_hz"]
    for column in columns:
        stem = column.removesuffix("_mm")
        header += [f"{stem}_per_input_mm_mm", f"{stem}_phase_deg", f"{stem}_per_force_mm_n", f"{stem}_force_phase_deg"]
    header += ["drive_per_force_mm_n", "drive_force_phase_deg"]
    rows: list[list[object]] = []
    for kind, answer in found.items():
        curves = [curve for c in columns for curve in (answer.per_input[c], answer.per_force_mm_n[c])]
        curves.append(answer.drive_per_force_mm_n)
        parts = [part for curve in curves for part in (np.abs(curve), np.degrees(np.angle(curve)))]
        rows += [[kind, *row] for row in zip(answer.frequency_hz, *parts, strict=True)]
    write_table(path, header, rows, digits=7)


def _draw_frequencies(found: Mapping[str, FrequencyResponse], column: str, title: str, path: Path) -> None:
    """Plot amplitude and phase per unit input (motion prescribed) and per unit force (drive free)."""
    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    (upper, upper_force), (lower, lower_force) = figure.subplots(2, 2, sharex=True, height_ratios=(3, 2))
    label = column.removesuffix("_mm").replace("_", " ")
    for place, (kind, answer) in enumerate(found.items()):
        style = {"linestyle": _STYLES[place % 3], "color": f"C{place}", "linewidth": 1.0}
        for axes, phases, curve in (
            (upper, lower, answer.per_input[column]), (upper_force, lower_force, answer.per_force_mm_n[column]),
        ):  # fmt: skip
            axes.semilogy(answer.frequency_hz, np.abs(curve), label=kind, **style)
            phases.plot(answer.frequency_hz, np.degrees(np.unwrap(np.angle(curve))), **style)
    main = next(iter(found.values()))
    for panels, modes in (((upper, lower), main.modes_hz), ((upper_force, lower_force), main.free_modes_hz)):
        for at in modes[(modes >= main.frequency_hz[0]) & (modes <= main.frequency_hz[-1])]:
            for axes in panels:
                # Also modes of parts that no probe observes, such as an intermediate stage.
                axes.axvline(at, color="0.6", linewidth=0.6, linestyle=":", zorder=1)
        panels[1].plot([], [], color="0.6", linewidth=0.6, linestyle=":", label="natural frequency")
        panels[1].legend(fontsize="small")
    upper.set_title("drive moved by a stiff stage", fontsize="medium")
    upper.set_ylabel(f"{label} per input / (mm/mm)")
    upper_force.set_title("drive pushed by a force, free to move", fontsize="medium")
    upper_force.set_ylabel(f"{label} per force / (mm/N)")
    for axes in (lower, lower_force):
        axes.set_ylabel("phase / degrees")
        axes.set_xlabel("frequency / Hz")
    for axes in (upper, upper_force):
        low, high = axes.get_ylim()
        if high < _LEAST_RANGE * low:
            # All tick labels of a decade would be equal where the curve is nearly constant.
            axes.set_yscale("linear")
            axes.set_ylim(low / _LEAST_RANGE, high * _LEAST_RANGE)
    for axes in (lower, lower_force):
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -_LEAST_DEG), max(high, _LEAST_DEG))
    for axes in (upper, lower, upper_force, lower_force):
        axes.grid(alpha=0.3, which="both")
    upper.legend()
    figure.suptitle(title)
    save_figure(figure, path)


def main_column(reduced: ModalModel, name: str) -> str:
    """Return the name of the length to plot: the gap if there is one, otherwise the length that changes most.

    Raises
    ------
    UsageError
        The drawing has neither a probe nor a pair of probes.
    """
    if not reduced.observed:
        raise UsageError(
            f"{name} must have a [[probe]] or a [[pair]] as the output of a response, but has none: add one point "
            "([[probe]]) or the distance of two ([[pair]])."
        )
    if GAP in reduced.observed:
        return GAP
    return max(reduced.observed, key=lambda column: abs(reduced.observed[column].per_input))


# `fingervision model --modes`: natural frequencies, with plots and a film of the mode shapes.

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
    save_figure(figure, out / "modes.png", dpi=110)
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
