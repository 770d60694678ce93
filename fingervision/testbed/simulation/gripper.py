"""A simulated gripper on a simulated or real stage: true positions of its points, with all injected effects."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import DriveEffect, History, PointEffect
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.gripper import Body, Gripper, Material
from fingervision.domain.model import Model
from fingervision.domain.response import Response
from fingervision.effects import catalogue
from fingervision.effects.backlash import EFFECT as BACKLASH
from fingervision.models.reference_mesh import REFERENCE_HINGE, REFERENCE_LEVER, REFERENCE_LINKS
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.simulation.injected_effects import Hidden, in_the_picture

Array = NDArray[np.float64]

# Time steps per frame in which the stage's motion is followed, so that creep and vibration are computed between frames.
STEPS_A_FRAME = 10
# Frame period until a camera sets its exposure times.
USUAL_PERIOD_S = 0.04
# Time beyond the requested time that is computed in advance while the stage is at rest.
AHEAD_S = 2.0
# Stiffness of the contact between the fingers, as seen at the drive.
CONTACT_N_PER_MM = 3.0


@dataclass(frozen=True, slots=True)
class Motion:
    """Position of the stage over time: past, present, and the planned future.

    Parameters
    ----------
    at_mm : callable
        Returns the positions at given times, shape (n,).
    known_until_s : callable
        Returns the time until which positions are known; afterwards the stage rests unless a new motion is requested.
    version : callable
        Returns a number that changes whenever the planned motion changes.
    homed_s : callable
        Returns the times at which the zero was referenced again: runs start there, at rest.
    began_s : callable
        Returns the time of the first motion; infinity before it.
    """

    at_mm: Callable[[Array], Array]
    known_until_s: Callable[[], float]
    version: Callable[[], int]
    homed_s: Callable[[], list[float]]
    began_s: Callable[[], float]


class SimulatedGripper:
    """The simulated mechanism, driven by a stage.

    Effects act by their own formulas over the whole history of the stage since the test bed was opened, in the order of
    the catalogue; effects that change the picture itself are applied by the simulated camera.

    Parameters
    ----------
    model : Model
        Model of the gripper as drawn.
    motion : Motion
        Motion of the stage.
    hidden : Hidden
        Injected effects.
    play_mm : float
        Play of the drive.
    since_s : float, optional
        Time since which the gripper has been warming and drifting; by default that of the first motion.
    """

    def __init__(
        self, model: Model, motion: Motion, hidden: Hidden, play_mm: float = 0.0, since_s: float | None = None
    ) -> None:
        self._model, self._motion = model, motion
        drive = dict(hidden.of_stage("drive"))
        if play_mm > 0.0:
            drive[BACKLASH.name] = {"play_mm": play_mm + drive.get(BACKLASH.name, {}).get("play_mm", 0.0)}
        camera = {name: values for name, values in hidden.of_stage("camera").items() if not in_the_picture(name)}
        self._drive = drive
        self._points: dict[str, Mapping[str, float]] = {**hidden.of_stage("mechanism"), **camera}
        self._rest_gap_mm = float(model.respond(np.zeros(1)).gap_mm[0])
        self._since_s = since_s
        self._begin_s, self._period_s = 0.0, USUAL_PERIOD_S
        self._known: tuple[object, Array, Response] | None = None

    def looked_at(self, begin_s: float, period_s: float) -> None:
        """Set the camera's exposure times: one time of the test bed, and every period before and after it."""
        self._begin_s, self._period_s = begin_s, period_s
        self._known = None

    def at(self, time_s: float) -> Response:
        """Positions of the measuring points, and the force, at one time of the test bed; arrays of one element.

        Before the first motion, the positions are those at rest.
        """
        began_s = self._motion.began_s()
        version = (self._motion.version(), len(self._motion.homed_s()), began_s)
        if self._known is None or self._known[0] != version or time_s > self._known[1][-1]:
            grid_s = self._grid_s(time_s, began_s if self._since_s is None else self._since_s)
            self._known = (version, grid_s, self._respond(grid_s))
        _, grid_s, known = self._known
        at = np.array([time_s])
        force = None if known.force_n is None else np.interp(at, grid_s, known.force_n)
        return Response(np.interp(at, grid_s, known.left_mm), np.interp(at, grid_s, known.right_mm), force)

    def slot_at(self, width_mm: float, time_s: float) -> Response:
        """Positions of the edges of a slot in place of the gripper, as seen by the camera with its injected effects."""
        began_s = self._motion.began_s() if self._since_s is None else self._since_s
        times_s = np.array([min(began_s, time_s - self._period_s), time_s])
        half = np.full(2, 0.5 * width_mm)
        edges = Response(-half, half)
        history = History(
            input_mm=np.zeros(2), time_s=times_s, runs=(slice(0, 2),), rest_gap_mm=width_mm, opening_mm=0.0
        )
        for name, effect in catalogue().items():
            if name in self._points and isinstance(effect, PointEffect) and effect.stage == "camera":
                edges = effect.act(edges, history, self._points[name])
        return Response(edges.left_mm[1:], edges.right_mm[1:])

    def _grid_s(self, time_s: float, since_s: float) -> Array:
        """Times (s) of a regular grid around `time_s`, at which the response is computed once and then interpolated."""
        until_s = time_s
        if since_s > time_s:
            since_s = time_s
        else:
            planned_s = self._motion.known_until_s()
            until_s = max(time_s + AHEAD_S, planned_s if np.isfinite(planned_s) else time_s)
        first, last = (np.floor((at_s - self._begin_s) / self._period_s) for at_s in (since_s, until_s))
        steps = np.arange((last - first + 2.0) * STEPS_A_FRAME) / STEPS_A_FRAME
        return np.asarray(self._begin_s + (first + steps) * self._period_s)

    def _respond(self, grid_s: Array) -> Response:
        u = self._motion.at_mm(grid_s)
        homed = (int(np.searchsorted(grid_s, at_s)) for at_s in self._motion.homed_s())
        borders = [0, *(at for at in homed if at < grid_s.size), grid_s.size]
        runs = tuple(slice(a, b) for a, b in pairwise(borders) if b > a)
        opening_mm = self._model.respond(u).gap_mm - self._rest_gap_mm
        history = History(
            input_mm=u,
            time_s=grid_s,
            runs=runs,
            rest_gap_mm=self._rest_gap_mm,
            opening_mm=float(np.max(np.abs(opening_mm))),
            closing_mm=float(max(0.0, -np.min(opening_mm))),
            force=True,
        )
        for name, effect in catalogue().items():
            if name in self._drive and isinstance(effect, DriveEffect):
                moved = self._act(effect, u, history)
                if effect.checks.get(FurtherCheck.REZERO) is True and len(runs) > 1:
                    moved[runs[1].start :] = u[runs[1].start :]
                u = moved
        response = self._model.respond(u)
        pressed_mm = np.zeros_like(u)
        for name, effect in catalogue().items():
            if name in self._points and isinstance(effect, PointEffect):
                acted = effect.act(response, history, self._points[name])
                if effect.checks.get(FurtherCheck.FORCE) is True:
                    pressed_mm = acted.gap_mm - response.gap_mm
                response = acted
        if response.force_n is None:
            return response
        return replace(response, force_n=response.force_n - CONTACT_N_PER_MM * pressed_mm)

    def _act(self, effect: DriveEffect, u: Array, history: History) -> Array:
        # The catalogue defines some effects on samples. If such an effect (stick-slip, for example) acted between two
        # frames, its jumps would occur at other positions, and the deviation would grow along a run.
        if not effect.at_frames:
            return effect.act(u, history, self._drive[effect.name])
        # For effects that act on frames, runs begin at a frame.
        borders = [-(-run.start // STEPS_A_FRAME) for run in history.runs] + [-(-u.size // STEPS_A_FRAME)]
        runs = tuple(slice(a, b) for a, b in pairwise(borders) if b > a)
        frames = u[::STEPS_A_FRAME]
        seen = replace(history, input_mm=frames, time_s=history.times[::STEPS_A_FRAME], runs=runs)
        return np.repeat(effect.act(frames, seen, self._drive[effect.name]), STEPS_A_FRAME)[: u.size]


# Drawing of the published physical sample, the default gripper of a simulated test bed.


def sample_gripper() -> Gripper:
    """Return the drawing of the published gripper; only its material and body are published values."""
    return Gripper(
        material=Material("PA2200", 1650.0, 0.34, 930.0, 48.0),
        body=Body(80.0, 100.0, 3.0, 4.0, 0.3),
        hinge=REFERENCE_HINGE,
        lever=REFERENCE_LEVER,
        links=REFERENCE_LINKS,
    )


class Followed:
    """An actuator that stores its readings, by which a simulated gripper is driven.

    Parameters
    ----------
    actuator : Actuator
        The real actuator.
    """

    def __init__(self, actuator: Actuator) -> None:
        self._actuator = actuator
        self._time_s: list[float] = []
        self._position_mm: list[float] = []
        self._homed_s: list[float] = []
        self._homing = False

    def __getattr__(self, name: str) -> Any:
        """Every other member is that of the actuator."""
        return getattr(self._actuator, name)

    @property
    def motion(self) -> Motion:
        """Motion of the stage as far as it was read from the actuator."""
        return Motion(
            self._at_mm, self._known_until_s, lambda: len(self._time_s), lambda: list(self._homed_s), self._began_s
        )

    def home(self) -> None:
        """Go to the reference."""
        self._actuator.home()
        self._homing = True

    def readings(self) -> tuple[Reading, ...]:
        """Positions since the last call, which are also stored."""
        readings = self._actuator.readings()
        newest = readings[-1]
        for reading in readings:
            # The age of streamed values relative to the newest value follows from the board's own clock.
            at_s = 0.5 * (newest.asked_s + newest.got_s) - (newest.device_s - reading.device_s)
            if not self._time_s or at_s > self._time_s[-1]:
                self._time_s.append(at_s)
                self._position_mm.append(reading.value)
        if self._homing and not self._actuator.busy:
            self._homing = False
            self._homed_s.append(self._time_s[-1])
        return readings

    def _at_mm(self, time_s: Array) -> Array:
        if not self._time_s:
            return np.zeros_like(time_s)
        return np.interp(time_s, self._time_s, self._position_mm)

    def _began_s(self) -> float:
        moved = (at_s for at_s, mm in zip(self._time_s, self._position_mm, strict=True) if mm != self._position_mm[0])
        return next(moved, float("inf"))

    def _known_until_s(self) -> float:
        return self._time_s[-1] if self._time_s else 0.0
