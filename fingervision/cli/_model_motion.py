"""`fingervision model --drive` and `--frequency`: dynamic response of a mechanism, as tables and plots."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.cli._model_figures import save_figure
from fingervision.cli._model_frequency import Band, answer_frequencies, main_column, moving, parse_band
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import UsageError
from fingervision.models.damping import parse_damping
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.modal_model import GAP, ModalModel, Motion, modal_motion
from fingervision.models.mode_shapes import ModesWanted, mode_shapes, parse_modes
from fingervision.models.motion_in_time import MODES, about_equilibria, check_small_vibration, gripper_motion
from fingervision.storage.simulation_table import write_motion
from fingervision.tables.read import read_drive

Array = NDArray[np.float64]

_MOST_ROWS = 2_000_000
_STYLES = ("-", "--", "-.")
_SEEN_ROWS = 60
"""Number of rows up to which the rows are also plotted as points."""
_DRAWN_ROWS, _SWINGS, _A_SWING = 600, 20, 12
"""Rows of a plot where the drive has fewer, about one per pixel; and the periods after a kink that are resolved, with
the rows per period: at the usual damping of 0.025 the vibration has then decayed to a twentieth."""


def at_rate(drive: DriveHistory, rate_hz: float | None) -> DriveHistory:
    """Interpolate the drive table linearly to a higher sampling rate, if the user requests one."""
    if rate_hz is None:
        return drive
    if not (isfinite(rate_hz) and rate_hz > 0.0):
        raise UsageError(f"--rate-hz must be a positive number of rows a second, but is {rate_hz:g}.")
    span_s = float(drive.time_s[-1] - drive.time_s[0])
    if span_s * rate_hz > _MOST_ROWS:
        raise UsageError(
            f"--rate-hz must give at most {_MOST_ROWS} rows, but {rate_hz:g} Hz over {span_s:g} s gives "
            f"{span_s * rate_hz:.3g}."
        )
    return _between(drive, lambda own: np.arange(own[0], own[-1], 1.0 / rate_hz))


def _between(drive: DriveHistory, more: Callable[[Array], Array]) -> DriveHistory:
    """Add rows to every run of a drive history, at the times that `more` gives for the run's own times."""
    runs = np.array(drive.run) if drive.run is not None else np.full(drive.time_s.size, "")
    times, inputs, names = [], [], []
    for name in dict.fromkeys(runs.tolist()):
        own, values = drive.time_s[runs == name], drive.input_mm[runs == name]
        # The drive's own samples are kept, because the input has its kinks there.
        at = np.union1d(more(own), own)
        times.append(at)
        inputs.append(np.interp(at, own, values))
        names += [name] * at.size
    return DriveHistory(np.concatenate(times), np.concatenate(inputs), tuple(names) if drive.run is not None else None)


def for_picture(drive: DriveHistory, first_mode_hz: float) -> DriveHistory:
    """Add rows to a sparse drive history, so that a plot shows the first touch and the vibration after every kink.

    Parameters
    ----------
    drive : DriveHistory
        The drive history.
    first_mode_hz : float
        Natural frequency of the slowest vibration.
    """
    if drive.time_s.size > _DRAWN_ROWS:
        return drive

    def more(own: Array) -> Array:
        even = np.linspace(own[0], own[-1], _DRAWN_ROWS)
        if own.size > _SEEN_ROWS:
            return even
        swing = np.arange(_SWINGS * _A_SWING) / (_A_SWING * first_mode_hz)
        after = (own[:, None] + swing).ravel()
        return np.union1d(even, after[after < own[-1]])

    return _between(drive, more)


@dataclass(frozen=True, slots=True)
class MotionAsked:
    """Options of `model` for responses over time and over frequency, checked before any computation."""

    drive: DriveHistory | None
    modes: ModesWanted | None
    band: Band | None
    damping: str
    film: bool

    @property
    def moves(self) -> bool:
        """Whether the user requested a response over time or over frequency."""
        return self.drive is not None or self.modes is not None or self.band is not None


def motion_asked(
    drive: Path | None,
    columns: Path | None,
    modes: str | None,
    frequency: str | None,
    damping: str,
    rate_hz: float | None,
    *,
    film: bool,
) -> MotionAsked:
    """Read and check the options for the dynamic response.

    Raises
    ------
    UsageError
        An option is wrong, or has no effect without another option.
    """
    parse_damping(damping)
    if film and modes is None:
        raise UsageError("--film needs --modes: it shows the modes in motion.")
    if rate_hz is not None and drive is None:
        raise UsageError(
            "--rate-hz sets the rows a second of response.csv, which is written only with --drive: add --drive."
        )
    return MotionAsked(
        None if drive is None else at_rate(read_drive(drive, columns), rate_hz),
        None if modes is None else parse_modes(modes),
        None if frequency is None else parse_band(frequency),
        damping,
        film,
    )


def move(
    models: Mapping[str, Any],
    asked: MotionAsked,
    name: str,
    folders: Mapping[str, Path],
    out: Path,
    *,
    static: Mapping[str, PchipInterpolator] | None = None,
    as_json: bool,
) -> None:
    """Compute all requested dynamic responses of the models of a drawing.

    With large rotation or contact, `static` gives the equilibria of every kind for a mechanism that is drawn by bodies:
    the observed lengths in order, then the force.
    """
    if asked.drive is not None:
        _follow_drive(models, asked.drive, asked.damping, name, folders, out, static=static or {}, as_json=as_json)
    if asked.band is not None:
        answer_frequencies(models, asked.band, asked.damping, name, out, as_json=as_json)
    if asked.modes is not None:
        from fingervision.cli._model_frequency import write_modes

        shapes = {
            kind: mode_shapes(getattr(model, "elastic", model), asked.modes)
            for kind, model in moving(models, "natural modes", as_json=as_json).items()
        }
        write_modes(shapes, name, out, film=asked.film, as_json=as_json)


def _follow_drive(
    models: Mapping[str, Any], drive: DriveHistory, damping: str, name: str, folders: Mapping[str, Path], out: Path,
    *, static: Mapping[str, PchipInterpolator], as_json: bool,
) -> None:  # fmt: skip
    """Write response.csv for every kind of model with masses, and one response.png that compares these kinds."""
    motions: dict[str, Motion] = {}
    shown: dict[str, Motion] = {}
    column = ""
    for kind, model in moving(models, "motion in time: it gives static results only", as_json=as_json).items():
        if isinstance(model, DrawnGripper):
            column = GAP
            found = gripper_motion(model, drive, parse_damping(damping))
            motion, method = found.motion, found.method
        else:
            reduced = model.modal_model(MODES)
            column = column or main_column(reduced, name)
            motion = _motion_of(model, reduced, drive, damping, static.get(kind), column)
            about = " about the static equilibria, without contact" if kind in static else ""
            method = f"{motion.modes_hz.size} modes{about}"
        motions[kind] = shown[kind] = motion
        finer = for_picture(drive, float(motion.modes_hz[0]))
        if finer.time_s.size > drive.time_s.size:
            shown[kind] = (
                gripper_motion(model, finer, parse_damping(damping)).motion
                if isinstance(model, DrawnGripper)
                else _motion_of(model, reduced, finer, damping, static.get(kind), column)
            )
        write_motion(folders[kind] / "response.csv", drive, motion.observed_mm, motion.force_n,
                     symmetric=isinstance(model, DrawnGripper))  # fmt: skip
        if not as_json:
            click.echo(f"{kind} in time by {method}; {words_of(motion, column)}")
    if motions:
        draw_motion(shown, motions, column, f"{name}, damping {damping}", out / "response.png")


def words_of(motion: Motion, column: str) -> str:
    """Sentence on a mechanism's vibration amplitude and its damping."""
    pairs = ", ".join(
        f"{z:.3g} at {f:.4g} Hz" for z, f in zip(motion.damping_ratios[:3], motion.modes_hz[:3], strict=True)
    )
    more = ", ..." if motion.modes_hz.size > 3 else ""
    return (
        f"damping ratio {pairs}{more}; {column.removesuffix('_mm')} differs from the static result by at most "
        f"{motion.vibration_mm(column):.3g} mm."
    )


def draw_motion(
    shown: Mapping[str, Motion], motions: Mapping[str, Motion], column: str, title: str, path: Path
) -> None:
    """Plot over time the input, one length, the difference of this length from the static response, and the force.

    Parameters
    ----------
    shown, motions : mapping of str to Motion
        By kind of model, the motion at the times that are plotted as a line, and at the drive's own rows.
    column : str
        Name of the length.
    title : str
        Title of the plot.
    path : Path
        File to write.
    """
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    label = column.removesuffix("_mm").replace("_", " ")
    for place, (kind, motion) in enumerate(shown.items()):
        curves = [_curves(own, column) for own in (motion, motions[kind])]
        style = {"linestyle": _STYLES[place % 3], "color": f"C{place}", "linewidth": 1.0}
        if place == 0:
            panels[0].plot(motion.drive.time_s, motion.drive.input_mm, color="0.3", linewidth=1.0)
        for axes, line, rows in zip(panels[1:], *curves, strict=True):
            axes.plot(motion.drive.time_s, line, label=kind, **style)
            if rows.size <= _SEEN_ROWS:
                axes.plot(motions[kind].drive.time_s, rows, "o", color=f"C{place}", markersize=4)
    names = ("input / mm", f"{label} / mm", f"{label} minus static / µm", "force at the drive / N")
    for axes, name in zip(panels, names, strict=True):
        axes.set_ylabel(name)
        axes.grid(alpha=0.3)
    panels[1].legend()
    panels[-1].set_xlabel("time / s")
    dots = "; dots: rows of the drive" if next(iter(motions.values())).drive.time_s.size <= _SEEN_ROWS else ""
    panels[0].set_title(f"{title}{dots}", fontsize="medium")
    save_figure(figure, path)


def _curves(motion: Motion, column: str) -> tuple[Array, Array, Array]:
    seen = motion.observed_mm[column]
    return seen, 1e3 * (seen - motion.static_mm[column]), motion.force_n


def _motion_of(
    model: ElasticMechanism,
    reduced: ModalModel,
    drive: DriveHistory,
    damping: str,
    static: PchipInterpolator | None,
    column: str,
) -> Motion:
    """Vibration of the modes about the linear response, or about the equilibria that `static` interpolates."""
    motion = modal_motion(reduced, drive, parse_damping(damping))
    if static is None:
        return motion
    *lengths, force = static(drive.input_mm).T
    named = dict(zip(motion.observed_mm, lengths, strict=True))
    check_small_vibration(motion, column, float(np.ptp(named[column])))
    touches = model.touch_input_mm().values()
    apart = np.all([drive.input_mm / at < 1.0 for at in touches], axis=0) if touches else None
    return about_equilibria(motion, named, force, apart)
