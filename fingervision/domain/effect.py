"""A physical effect: something that happens between the recorded input and the measured points."""

from collections.abc import Callable, Mapping
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


REZEROED = "rezeroed"
"""Word in the name of a run that came after a re-zeroing of the stage."""


class Stage(StrEnum):
    """Where in the measuring chain an effect acts."""

    DRIVE = "drive"
    MECHANISM = "mechanism"
    CAMERA = "camera"


@dataclass(frozen=True, eq=False)
class History:
    """The samples over which effects are computed: what an effect may use besides the signal that it acts on.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input; runs one after the other, sorted by time within each.
    time_s : ndarray of float, shape (n,), or None
        Times; None where the table has none, and the order of rows then means nothing.
    runs : tuple of slice
        The samples of each run.
    rest_gap_mm : float
        g0, the model's gap at input zero.
    opening_mm : float
        Largest absolute opening that the model predicts.
    closing_mm : float
        Largest closing below the rest gap that the model predicts; 0 where it only opens.
    shared_clock : bool
        Whether times go on from run to run. Where they restart, the runs share no clock.
    input_sigma_mm : float
        Standard uncertainty of one recorded input (noise, encoder step).
    input_step_mm : float
        Step of the encoder; 0 where none shows.
    both_edges : bool
        Whether left and right were measured, or the gap alone.
    force : bool
        Whether a force was measured.
    rezeroed : tuple of bool
        Which runs came after a re-zeroing of the stage that others came before; empty where none did.
    dwell_s : float
        Shortest time for which the stage stood before it was read; 0 where it was read on its way.
    commanded : bool
        Whether the input is a command that keeps its value until it jumps.
    bodies : bool
        Whether effects with a place are tried by their forms with a table; a diagnosis looks for places by itself.
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
        """Times of the samples, shape (n,); only for an effect that declares that it needs times."""
        if self.time_s is None:
            message = "an effect that needs times was run on a table without them."
            raise ValueError(message)
        return self.time_s

    @cached_property
    def clock_s(self) -> Array:
        """Time since the table's first sample, shape (n,)."""
        return np.asarray(self.times - self.times.min(), dtype=np.float64)

    @cached_property
    def sample_time_s(self) -> float:
        """Median time between neighbouring samples of a run."""
        steps = np.concatenate([np.diff(self.times[run]) for run in self.runs])
        return float(np.median(steps)) if steps.size else 1.0

    @cached_property
    def input_span_mm(self) -> float:
        """Range of the recorded input."""
        return float(np.ptp(self.input_mm))


@dataclass(frozen=True, slots=True, eq=False)
class InputPath:
    """Path of the input, with points between and outside the measured rows, for effects with memory such as backlash.

    Parameters
    ----------
    history : History
        The chain's history at every point of the path, of which there are m.
    rows : ndarray of int, shape (n,)
        Where on the path each measured row lies.
    owner : ndarray of int, shape (m,)
        The measured row whose recorded input a point repeats; -1 where it has its own.
    """

    history: History
    rows: NDArray[np.intp]
    owner: NDArray[np.intp]

    def moved(self, by_mm: Array) -> "InputPath":
        """Shift the recorded inputs of the measured rows and of the points that repeat them; `by_mm` of shape (n,)."""
        shift = np.where(self.owner >= 0, by_mm[self.owner], 0.0)
        return replace(self, history=replace(self.history, input_mm=self.history.input_mm + shift))


def effect_key(name: str, place: str = "", end: str = "") -> str:
    """Spell an effect with its place: `hinge_stiffness_error@right hinge 2`; the bare name where it has none.

    Parameters
    ----------
    name : str
        In the catalogue.
    place : str
        Hinge or link as the drawing calls it.
    end : str
        Which end of a link sits off.
    """
    return name if not place else f"{name}@{place}" + (f"; {end}" if end else "")


def split_key(key: str) -> tuple[str, str, str]:
    """Split an effect's key into its name, its place, and the end of that place."""
    name, _, rest = key.partition("@")
    place, _, end = rest.partition("; ")
    return name, place, end


DriveAct = Callable[[Array, History, Values], Array]
PointAct = Callable[[Response, History, Values], Response]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One physical effect of the catalogue.

    Parameters
    ----------
    name : str
        Canonical name.
    stage : Stage
        Drive, mechanism or camera.
    order : float
        Place in the chain within the stage: effects act in ascending order. The catalogue's own have whole tens
        (`fingervision effects NAME` prints them), so that another may stand between two: one that acts on what the play
        (60) has left, and before the jumps (70), has 65. By default last of its stage.
    words : str
        What happens, in half a sentence.
    formula : str
        The definition with a simulation table.
    source : str
        Where the law is from.
    residual : str
        How it looks in measured minus simulated.
    parameters : tuple of Parameter
        With bounds that hold for every table.
    needs_times, needs_shared_clock, needs_edges, needs_force : bool
        Data without which the effect is excluded.
    needs_bodies : bool
        Whether poses of bodies show it and the gap alone does not.
    memory : bool
        Whether the past counts.
    start : str
        What the state of an effect with memory is at a run's start, in words; empty where it is known. Such a start is
        a nuisance of its run: a number from -1 to 1 under the key `start_key(run)`.
    curve : bool
        Whether its form is a curve that is estimated as a whole; its parameters then only describe the curve.
    narrow : callable or None
        Bounds that follow from the data: `narrow(history)` gives the parameters to search, or the reason why
        these data cannot show the effect.
    foretold : mapping of str to (float, float)
        Where a drawing foretells the effect: the ranges that its parameters then lie in.
    checks : mapping of FurtherCheck to bool
        Checks beside the stage's motion in which it shows (True) or stays out (False); the others do not concern it.
    stands_at : tuple of str
        Ends of the range (`closed`, `open`) at which the reading stands while the command moves on.
    delay_s : callable or None
        For what is a delay or looks like one at slow motion: `delay_s(values)` gives it. An effect that has
        `act_curved` is a delay, with the one parameter `delay_s`.
    wave : (str, str) or None
        For a sine over the recorded input: the names of its amplitude and of its period, both in mm.
    drawn_with : mapping of str to float
        Values for its picture in the catalogue, where a share of the range would not show how it looks.
    odd : tuple of str
        Parameters that change their sign when the picture is mirrored.
    in_picture : callable or None
        For an effect of the camera that changes the picture itself: `in_picture(values)` says how. Without it a
        simulated camera sees the two points moved, which for drifts and scales is the same.
    at_frames : bool
        Whether it is defined on the samples: a simulation looks at it with the frames, not in between.
    in_drawing : DrawingForm or None
        How it acts beside a drawing whose bodies' poses were measured; None where these do not show it.
    demonstrated : bool
        Whether a few short runs can tell it from everything else: `fingervision demo` hides one of these.
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
    curve: bool = False
    narrow: Callable[[History], "tuple[Parameter, ...] | str"] | None = None
    foretold: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))
    checks: Mapping[FurtherCheck, bool] = field(default_factory=lambda: MappingProxyType({}))
    stands_at: tuple[str, ...] = ()
    delay_s: Callable[[Values], float] | None = None
    wave: tuple[str, str] | None = None
    drawn_with: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    odd: tuple[str, ...] = ()
    in_picture: Callable[[Values], PictureForm] | None = None
    at_frames: bool = False
    in_drawing: DrawingForm | None = None
    demonstrated: bool = False

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
            return "it is told by poses of bodies beside a drawing, and not by the gap alone"
        found = self.parameters if self.narrow is None else self.narrow(history)
        if isinstance(found, str) or not self.start:
            return found
        return (*found, *(_start(self.start, run) for run in range(len(history.runs))))


def start_key(run: int) -> str:
    """Return the key of a run's start state among an effect's parameter values."""
    return f"start_{run + 1}"


def _start(words: str, run: int) -> Parameter:
    return Parameter(start_key(run), "", -1.0, 1.0, f"{words}, in run {run + 1}", run=run)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEffect(Effect):
    """An effect on the input: `act(input_mm, history, values)` returns the input that the mechanism receives.

    `act_curved` computes the same effect for a stage that moved along a curve, not a straight line, between two
    samples; None where that makes no difference. Only delays need it.
    """

    act: DriveAct
    act_curved: DriveAct | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PointEffect(Effect):
    """An effect of the mechanism or camera: `act(response, history, values)` returns the changed measuring points.

    `act_curved` means the same as in `DriveEffect`.
    """

    act: PointAct
    act_curved: PointAct | None = None
