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

from fingervision.cli._model_frequency import Band, answer_frequencies, main_column, mechanism_frequencies, parse_band
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import UsageError
from fingervision.models.damping_text import parse_damping
from fingervision.models.driven_body import DrivenBody
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.modal_model import ModalModel
from fingervision.models.modal_response import Motion, modal_motion
from fingervision.models.mode_shapes import ModesWanted, mechanism_mode_shapes, parse_modes
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
    models: Mapping[str, Any], asked: MotionAsked, name: str, folders: Mapping[str, Path], out: Path, *, as_json: bool
) -> None:
    """Compute all requested dynamic responses of a gripper's models."""
    if asked.drive is not None:
        follow_drive(models, asked.drive, asked.damping, name, folders, out, as_json=as_json)
    if asked.band is not None:
        answer_frequencies(models, asked.band, asked.damping, name, out, as_json=as_json)
    if asked.modes is not None:
        from fingervision.cli._model_modes import write_gripper_modes

        write_gripper_modes(models, asked.modes, name, out, film=asked.film, as_json=as_json)


def move_mechanism(
    models: Mapping[str, MechanismPlate | MechanismFrame],
    asked: MotionAsked,
    static: Mapping[str, PchipInterpolator],
    folders: Mapping[str, Path],
    out: Path,
    *,
    as_json: bool,
) -> None:
    """Compute all requested dynamic responses of the models of a mechanism whose drawing lists its bodies.

    With large rotation or contact, `static` gives the equilibria of every kind: the observed lengths in order, then the
    force.
    """
    name = next(iter(models.values())).mechanism.name
    if asked.drive is not None:
        mechanism_motion(models, asked.drive, asked.damping, static, folders, out, as_json=as_json)
    if asked.band is not None:
        mechanism_frequencies(models, asked.band, asked.damping, out, as_json=as_json)
    if asked.modes is not None:
        from fingervision.cli._model_modes import write_modes

        shapes = {kind: mechanism_mode_shapes(model, asked.modes) for kind, model in models.items()}
        write_modes(shapes, name, out, film=asked.film, as_json=as_json)


def follow_drive(
    models: Mapping[str, Any], drive: DriveHistory, damping: str, name: str, folders: Mapping[str, Path], out: Path,
    *, as_json: bool,
) -> None:  # fmt: skip
    """Write response.csv for every kind of model with masses, and one response.png that compares these kinds."""
    motions: dict[str, Motion] = {}
    shown: dict[str, Motion] = {}
    for kind, model in models.items():
        if not isinstance(getattr(model, "half", None), DrivenBody):
            if not as_json:
                click.echo(
                    f"{kind} has no masses in the plane: for a drive, it gives static results only (simulation.csv)."
                )
            continue
        found = gripper_motion(model, drive, parse_damping(damping))
        motions[kind] = found.motion
        finer = for_picture(drive, float(found.motion.modes_hz[0]))
        sparse = finer.time_s.size > drive.time_s.size
        shown[kind] = gripper_motion(model, finer, parse_damping(damping)).motion if sparse else found.motion
        write_motion(folders[kind] / "response.csv", drive, found.motion.observed_mm, found.motion.force_n,
                     symmetric=True)  # fmt: skip
        if not as_json:
            click.echo(f"{kind} in time by {found.method}; {words_of(found.motion, 'gap_mm')}")
    if motions:
        draw_motion(shown, motions, "gap_mm", f"{name}, damping {damping}", out / "response.png")


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
    figure.savefig(path, dpi=130)


def _curves(motion: Motion, column: str) -> tuple[Array, Array, Array]:
    seen = motion.observed_mm[column]
    return seen, 1e3 * (seen - motion.static_mm[column]), motion.force_n


def mechanism_motion(
    models: Mapping[str, MechanismPlate | MechanismFrame],
    drive: DriveHistory,
    damping: str,
    static: Mapping[str, PchipInterpolator],
    folders: Mapping[str, Path],
    out: Path,
    *,
    as_json: bool,
) -> None:
    """Write response.csv of every kind, and one response.png that compares them; see `move_mechanism`."""
    motions: dict[str, Motion] = {}
    shown: dict[str, Motion] = {}
    column = ""
    for kind, model in models.items():
        reduced = model.modal_model(MODES)
        if not reduced.observed:
            raise UsageError(
                f"{model.mechanism.name} must have a [[probe]] or a [[pair]] as the output of the response in time, "
                "but has none: add one point ([[probe]]) or the distance of two ([[pair]])."
            )
        column = column or main_column(reduced)
        curve = static.get(kind)
        motion = motions[kind] = _motion_of(model, reduced, drive, damping, curve, column)
        finer = for_picture(drive, float(reduced.modes_hz[0]))
        sparse = finer.time_s.size > drive.time_s.size
        shown[kind] = _motion_of(model, reduced, finer, damping, curve, column) if sparse else motion
        write_motion(folders[kind] / "response.csv", drive, motion.observed_mm, motion.force_n)
        if not as_json:
            about = " about the static equilibria, without contact" if kind in static else ""
            click.echo(f"{kind} in time by {motion.modes_hz.size} modes{about}; {words_of(motion, column)}")
    title = f"{next(iter(models.values())).mechanism.name}, damping {damping}"
    draw_motion(shown, motions, column, title, out / "response.png")


def _motion_of(
    model: MechanismPlate | MechanismFrame,
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
