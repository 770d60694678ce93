"""Physical effects that act between the recorded input and the measured points."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drawing_form import DrawingForm
from fingervision.domain.further_check import FurtherCheck, PictureForm
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response

Values = Mapping[str, float]
Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


PLACES = 1000
"""Cells into which the range of the input is divided to find how closely it was passed."""

REZEROED = "rezeroed"
"""Word in the name of a run that was recorded after a re-zeroing of the stage."""


class Stage(StrEnum):
    """Section of the measuring chain in which an effect acts: drive, mechanism or camera."""

    DRIVE = "drive"
    MECHANISM = "mechanism"
    CAMERA = "camera"


@dataclass(frozen=True, eq=False)
class History:
    """Samples over which effects are computed, with all data that an effect may use besides its input signal.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input, run after run, sorted by time within each run.
    time_s : ndarray of float, shape (n,), or None
        Times; None if the table has no times, in which case the order of rows has no meaning.
    runs : tuple of slice
        The samples of each run.
    rest_gap_mm : float
        g0, the gap that the model predicts at input zero.
    opening_mm : float
        Largest absolute opening that the model predicts.
    closing_mm : float
        Largest closing below the rest gap that the model predicts; 0 if the gripper only opens.
    shared_clock : bool
        Whether times continue from run to run. If times restart with each run, the runs have no common clock.
    input_sigma_mm : float
        Standard uncertainty of one recorded input (noise, encoder step).
    input_step_mm : float
        Resolution step of the encoder; 0 if the recorded input shows no steps.
    both_edges : bool
        Whether the positions of both fingers were measured (True), or only the gap (False).
    force : bool
        Whether a force was measured.
    rezeroed : tuple of bool
        For each run, whether it was recorded after a re-zeroing of the stage that followed earlier runs; empty without
        a re-zeroing.
    dwell_s : float
        Shortest time for which the stage rested before its position was recorded, in s; 0 if positions were recorded
        during the motion.
    commanded : bool
        Whether the input is a commanded position that is constant between jumps.
    bodies : bool
        Whether effects that act on one part of the mechanism are tried with their formulas for a simulation table; a
        diagnosis with measured poses of bodies searches for the part separately.
    """

    input_mm: Array
    time_s: Array | None
    runs: tuple[slice, ...]
    rest_gap_mm: float
    opening_mm: float
    closing_mm: float = 0.0
    shared_clock: bool = True
    input_sigma_mm: float = 0.0
    input_step_mm: float = 0.0
    both_edges: bool = True
    force: bool = False
    rezeroed: tuple[bool, ...] = ()
    dwell_s: float = 0.0
    commanded: bool = False
    bodies: bool = False

    @property
    def times(self) -> Array:
        """Times of the samples (s), shape (n,); only for effects that declare `needs_times`."""
        if self.time_s is None:
            message = "An effect that needs times was computed for a table without times."
            raise ValueError(message)
        return self.time_s

    @cached_property
    def clock_s(self) -> Array:
        """Time since the first sample of the table (s), shape (n,)."""
        return np.asarray(self.times - self.times.min(), dtype=np.float64)

    @cached_property
    def sample_time_s(self) -> float:
        """Median time between successive samples of a run (s)."""
        steps = np.concatenate([np.diff(self.times[run]) for run in self.runs])
        return float(np.median(steps)) if steps.size else 1.0

    def rate_of(self, signal: Array) -> Array:
        """Rate of change of a signal within each run (its unit per second), shape (n,); 0 in a run of one sample."""
        rates = np.zeros(signal.shape)
        for run in self.runs:
            if run.stop - run.start > 1:
                rates[run] = np.gradient(signal[run], self.times[run])
        return rates

    @cached_property
    def travel_mm(self) -> float:
        """Way of the recorded input within the runs, there and back (mm)."""
        return sum(float(np.sum(np.abs(np.diff(self.input_mm[run])))) for run in self.runs)

    @cached_property
    def input_span_mm(self) -> float:
        """Difference between the largest and smallest recorded input (mm)."""
        return float(np.ptp(self.input_mm))

    @cached_property
    def resolved_mm(self) -> float:
        """Step of the input (mm) in which half of the range was passed; each place counts by the shortest step over it.

        The noise of readings at rest passes no place, and a fast way back hides no slow way out. In a median over the
        rows, the noise of a staircase's record would count as steps, and a period of 1 um would be found in it.
        """
        input_mm = np.sort(self.input_mm) if self.time_s is None else self.input_mm
        # A step that ends in the cell in which it begins passes no place.
        cells = (input_mm - input_mm.min()) / max(self.input_span_mm, 1e-300) * PLACES
        cell, steps_mm = np.round(cells).astype(int), np.abs(np.diff(input_mm))
        shortest_mm = np.full(PLACES, np.inf)
        for i in np.argsort(-steps_mm, kind="stable"):
            shortest_mm[min(cell[i], cell[i + 1]) : max(cell[i], cell[i + 1])] = steps_mm[i]
        return float(np.median(shortest_mm))


@dataclass(frozen=True, slots=True, eq=False)
class InputPath:
    """Path of the input with points besides the measured rows, as needed for effects with memory such as backlash.

    Parameters
    ----------
    history : History
        History at all m points of the path.
    rows : ndarray of int, shape (n,)
        Index of the path's point at which each measured row lies.
    owner : ndarray of int, shape (m,)
        For each point, index of the measured row whose recorded input it repeats; -1 for a point with an input of its
        own.
    """

    history: History
    rows: NDArray[np.intp]
    owner: NDArray[np.intp]

    def moved(self, by_mm: Array) -> "InputPath":
        """Shift the inputs of the measured rows, and of the path's points that repeat them, by `by_mm`, shape (n,)."""
        shift = np.where(self.owner >= 0, by_mm[self.owner], 0.0)
        return replace(self, history=replace(self.history, input_mm=self.history.input_mm + shift))


def effect_key(name: str, place: str = "", end: str = "") -> str:
    """Join an effect's name and place: `hinge_stiffness_error@right hinge 2`; without a place, return only the name.

    Parameters
    ----------
    name : str
        Name of the effect in the catalogue.
    place : str
        Name of the hinge or link in the drawing.
    end : str
        The end of a link that is displaced.
    """
    return name if not place else f"{name}@{place}" + (f"; {end}" if end else "")


def split_key(key: str) -> tuple[str, str, str]:
    """Split an effect's key into the effect's name, its place (a hinge or link), and the end of that link."""
    name, _, rest = key.partition("@")
    place, _, end = rest.partition("; ")
    return name, place, end


DriveAct = Callable[[Array, History, Values], Array]
PointAct = Callable[[Response, History, Values], Response]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Effect:
    """One physical effect of the catalogue.

    Parameters
    ----------
    name : str
        Name of the effect in the catalogue, as used in all files.
    stage : Stage
        Section of the measuring chain in which the effect acts: drive, mechanism or camera.
    order : float
        Position in the section of the chain: effects act in ascending order. `fingervision effects NAME` prints that
        of a built-in effect, and a user-defined one may be put between any two: an effect that acts after the play (60)
        and before the jumps (70) has, for example, 65. By default, the effect acts last in its section.
    words : str
        Short description of the effect.
    formula : str
        Formula that defines the effect if the model is a simulation table.
    source : str
        Source of the physical law.
    residual : str
        Description of the residual (measured minus simulated gap) that the effect causes.
    parameters : tuple of Parameter
        Parameters of the effect, with bounds that are valid for every table.
    needs_times, needs_shared_clock, needs_edges, needs_force : bool
        Kinds of data without which the effect is excluded from a diagnosis.
    needs_bodies : bool
        Whether the effect is visible only in measured poses of bodies, not in the gap.
    memory : bool
        Whether the effect depends on earlier samples of the run.
    start : str
        Description of the unknown state of an effect with memory at the start of a run; empty if the state is known.
        The start state is a nuisance parameter of the run: a number from -1 to 1 under the key `start_key(run)`.
    starts_at_ends : bool
        Whether every long motion leaves the state at -1 or 1, as it takes up a play, so that most runs begin there.
    curve : bool
        Whether the effect is a curve that is estimated as a whole; the parameters then only describe this curve.
    narrow : callable or None
        Function for bounds that depend on the data: `narrow(history)` returns the parameters to search, or the reason
        why these data cannot show the effect.
    inexact : callable or None
        Function `inexact(values)` for an effect whose formula is a stand-in: it returns parameter values, also such as
        are no parameters, each of which differs from the given ones by a standard deviation of the formula's error.
    foretold : mapping of str to (float, float)
        Ranges of the effect's parameters that follow from a drawing; empty if the drawing determines none.
    checks : mapping of FurtherCheck to bool
        Checks without a motion of the stage in which the effect is visible (True) or not visible (False); checks that
        are not listed give no information on the effect.
    stands_at : tuple of str
        Ends of the range (`closed`, `open`) at which the measured value remains constant while the commanded position
        still changes.
    delay_s : callable or None
        Function `delay_s(values)` that returns the delay of an effect that is a delay, or resembles a delay at slow
        motion. An effect that has `act_curved` is a delay, with `delay_s` as its only parameter.
    most_together : float
        Largest sum of the parameters, if they are shares of the same thing.
    wave : (str, str) or None
        Names of the parameters amplitude and period (both in mm) of an effect that is a sine over the recorded input.
    drawn_with : mapping of str to float
        Parameter values for the effect's plot in the catalogue, if the usual fraction of the range would not show its
        shape.
    like_wrong_zero : bool
        Whether the effect acts like a wrong zero of the encoder: below one step of it, the data cannot tell them apart.
    odd : tuple of str
        Names of parameters that change sign when the picture is mirrored.
    in_picture : callable or None
        Function `in_picture(values)` for a camera effect that changes the whole picture; it returns the change. Without
        this function, a simulated camera only moves the two measuring points, which is equivalent for drifts and
        scales.
    at_frames : bool
        Whether the effect is defined on the samples, so that a simulation evaluates it at the times of the video frames
        only, not between them.
    in_drawing : DrawingForm or None
        Action of the effect on a drawing if poses of its bodies were measured; None if such poses do not show the
        effect.
    demonstrated : bool
        Whether a few short runs can distinguish the effect from all others; `fingervision demo` hides one of these
        effects.
    """

    name: str
    stage: Stage
    order: float = float("inf")
    words: str
    formula: str
    source: str
    residual: str
    parameters: tuple[Parameter, ...]
    needs_times: bool = False
    needs_shared_clock: bool = False
    needs_edges: bool = False
    needs_force: bool = False
    needs_bodies: bool = False
    memory: bool = False
    start: str = ""
    starts_at_ends: bool = False
    curve: bool = False
    narrow: Callable[[History], "tuple[Parameter, ...] | str"] | None = None
    inexact: Callable[[Values], tuple[Values, ...]] | None = None
    foretold: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))
    checks: Mapping[FurtherCheck, bool] = field(default_factory=lambda: MappingProxyType({}))
    stands_at: tuple[str, ...] = ()
    delay_s: Callable[[Values], float] | None = None
    most_together: float = float("inf")
    wave: tuple[str, str] | None = None
    drawn_with: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    like_wrong_zero: bool = False
    odd: tuple[str, ...] = ()
    in_picture: Callable[[Values], PictureForm] | None = None
    at_frames: bool = False
    in_drawing: DrawingForm | None = None
    demonstrated: bool = False

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name}: {self.words})"

    def search(self, history: History) -> tuple[Parameter, ...] | str:
        """Return the parameters with bounds narrowed to what the data can show, or the reason why they show nothing."""
        if self.needs_times and history.time_s is None:
            return "the table has no time_s, and without times the order of rows means nothing"
        if self.needs_shared_clock and not history.shared_clock:
            return "time_s restarts between runs, so the runs share no clock"
        if self.needs_edges and not history.both_edges:
            return "the table has no left_mm and right_mm, and the gap alone does not show it"
        if self.needs_force and not history.force:
            return "the table has no force_n, and the gap hardly shows it"
        if self.needs_bodies and not history.bodies:
            return "only measured poses of bodies, compared with a drawing, show this effect; the gap alone does not"
        found = self.parameters if self.narrow is None else self.narrow(history)
        if isinstance(found, str) or not self.start:
            return found
        return (*found, *(_start(self, run) for run in range(len(history.runs))))

    def within(self, values: Values) -> dict[str, float]:
        """Return parameter values whose sum is at most `most_together`: larger ones are scaled by one factor."""
        own = {p.name: values[p.name] for p in self.parameters if p.name in values}
        scale = min(1.0, self.most_together / max(sum(own.values()), 1e-300))
        return {**values, **{name: scale * value for name, value in own.items()}} if scale < 1.0 else dict(values)


def curve_values(inputs_mm: Sequence[float], errors_mm: Sequence[float]) -> dict[str, float]:
    """Encode the points of an effect that is a curve as parameter values."""
    out: dict[str, float] = {}
    for k, (at, error) in enumerate(zip(inputs_mm, errors_mm, strict=True), start=1):
        out |= {f"point_{k}_input_mm": float(at), f"point_{k}_error_mm": float(error)}
    return out


def curve_points(values: Values) -> tuple[Array, Array]:
    """Decode inputs and errors of an effect's curve from parameter values, each of shape (k,).

    The arrays are empty if the values encode no curve.
    """
    count = sum(key.endswith("_error_mm") for key in values)
    inputs, errors = ([values[f"point_{k}_{what}_mm"] for k in range(1, count + 1)] for what in ("input", "error"))
    return np.array(inputs), np.array(errors)


def start_key(run: int) -> str:
    """Return the key under which an effect's parameter values hold the start state of a run."""
    return f"start_{run + 1}"


def _start(effect: Effect, run: int) -> Parameter:
    words = f"{effect.start}, in run {run + 1}"
    return Parameter(start_key(run), "", -1.0, 1.0, words, run=run, at_ends=effect.starts_at_ends)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DriveEffect(Effect):
    """An effect of the drive: `act(input_mm, history, values)` returns the input that the mechanism receives.

    `act_curved` computes the same effect for a stage whose position over time is curved, not linear, between two
    samples; None for effects that do not depend on this. Only delays need `act_curved`.
    """

    act: DriveAct
    act_curved: DriveAct | None = None


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PointEffect(Effect):
    """An effect of the mechanism or camera: `act(response, history, values)` returns the changed measuring points.

    `act_curved` has the same meaning as in `DriveEffect`.
    """

    act: PointAct
    act_curved: PointAct | None = None
