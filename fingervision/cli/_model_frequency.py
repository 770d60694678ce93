"""`fingervision model --frequency`: response of a mechanism to a vibrating drive."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite, pi
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure

from fingervision.domain.errors import UsageError
from fingervision.models.damping import parse_damping
from fingervision.models.modal_model import (
    GAP,
    FreeModes,
    FrequencyResponse,
    ModalModel,
    described,
    frequency_response,
    resolved_frequencies_hz,
)
from fingervision.models.motion_in_time import MODES
from fingervision.storage.row_file import write_table

_MOST_MODES = 60
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
        at = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
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
    figure.savefig(path, dpi=130)


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
