"""One axis behind a driver of seven calls: limits, watchdog, lost steps, refusals and silence are handled here, once.

A kind of stage is a subclass that translates seven calls into its own protocol. What every stage must do (refuse a
target beyond the limits, refuse a second motion, stop at any time, end a motion that never arrives, notice that it
rests at another place than it was sent to) stands in this file, so that no kind can forget it.

A device that can be told no speed is led along a ramp of positions. The ramp needs no thread: the position that is due
is sent whenever the stage is looked at, which a test bed does at each frame and every 20 ms while it waits. If the
program is killed, the stage therefore stands still.
"""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Self, TypeVar

from fingervision.domain.errors import DeviceError, FingervisionError, StateError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, RefusedError, StageLimits, in_a_line
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import LIMIT_KEYS, FreeMoves, check_move, stage_limits

T = TypeVar("T")
KEYS = (*LIMIT_KEYS, "zero_mm", "reversed")
# A motion counts as stuck after PATIENCE times its duration plus PATIENCE_S; homing, of unknown length, after HOME_S.
PATIENCE, PATIENCE_S, HOME_S = 1.5, 2.0, 120.0
# A stepper loses steps by whole electrical cycles of four full steps: 20 um for 200 steps per turn and a lead of 1 mm.
LOST_MM = 0.02
HOMING_MM_S = 1.0
LOOK_EVERY_S = 0.01
# A controller states a position that is refreshed at intervals, and may be ahead of the stage or behind it by one of
# them: at most 0.2 s, twice the interval of the usual scan of an EPICS server.
REFRESHED_S = 0.2
# A stage stands still if for STILL_S it was slower than a tenth of its speed: less is the noise of its encoder. In that
# time its position was refreshed, and a stage at speed went on by more than this tenth before. The search of a
# reference ends in a slow approach, whose speed is the device's own: it stands still below 5 um/s.
STILL_SHARE, STILL_MM = 0.1, 0.001
STILL_S = REFRESHED_S / (1.0 - STILL_SHARE)
# No stage of the right units is twice as fast as it was told; the wrong ones differ by 10, 25.4, 60 or 1000.
TOO_FAST = 2.0


@dataclass(frozen=True, slots=True)
class AxisSettings:
    """What a configuration states about a stage.

    Parameters
    ----------
    limits : StageLimits
        Limits of the stage, in the test bed's coordinate.
    zero_mm : float
        Position of the device at the test bed's position 0.
    sign : float
        -1 if the device counts against the test bed's direction (positive positions open the gripper), else 1.
    """

    limits: StageLimits
    zero_mm: float = 0.0
    sign: float = 1.0


def stated_axis(section: Section) -> AxisSettings:
    """Read the settings listed in `KEYS`."""
    limits = stage_limits(section)
    return AxisSettings(limits, section.number("zero_mm", 0.0), -1.0 if section.flag("reversed") else 1.0)


@dataclass(frozen=True, slots=True)
class _Motion:
    """A commanded motion: target (None while homing), times of its begin and latest end, its begin and its speed."""

    to_mm: float | None
    began_s: float
    until_s: float
    from_mm: float = 0.0
    speed_mm_s: float = inf


class SingleAxis(FreeMoves, ABC):
    """An actuator (`testbed.actuator`) without step data; the seven calls may raise any exception.

    Parameters
    ----------
    name : str
        Name of the actuator in run.json and in errors.
    clock : Clock
        Clock of the test bed.
    settings : AxisSettings
        Limits and coordinate of the stage.
    """

    # Whether the device knows its position; a device that can say so states it while it is asked whether it moves.
    _homed = True

    def __init__(self, name: str, clock: Clock, settings: AxisSettings) -> None:
        super().__init__(settings.limits, name)
        self._clock, self._settings = clock, settings
        self._line = threading.RLock()  # keeps each question together with its answer
        self._refusal: Alarm | None = None
        self._fault: Alarm | None = None
        self._motion: _Motion | None = None
        self._stops = 0
        self._closed = self._seen = False
        # The last position, that which the stage held before, since when, and by how much and how long it must be held.
        self._now_mm, self._held_mm, self._since_s, self._still_mm, self._still_s = inf, inf, -inf, STILL_MM, STILL_S
        # The longest way between two successive positions of the motion.
        self._jump_mm = 0.0

    # Seven calls of a driver; positions are those of the device (mm).

    @abstractmethod
    def _moving(self) -> bool:
        """Query the device whether a motion is in progress."""

    @abstractmethod
    def _position_mm(self) -> float:
        """Query the device for its position."""

    @abstractmethod
    def _go_home(self) -> None:
        """Begin to search the reference; do nothing if the device has none: then it only moves to its zero."""

    @abstractmethod
    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position; raise `RefusedError` if the device does not accept the command."""

    @abstractmethod
    def _halt(self) -> None:
        """Stop the motion; called from any thread and during any other call, so that it must not wait for them."""

    @abstractmethod
    def _release(self) -> None:
        """Close the connection."""

    def _set_up(self) -> None:
        """Say the first words to the device, and check what it answers."""
        self._at_mm()

    def at_rest(self) -> Self:
        """Return the stage after its set-up, and after ending a motion that a killed program has left behind.

        If that fails, the connection is closed.
        """
        try:
            self._set_up()
            self._come_to_rest()
        except BaseException:
            with suppress(Exception):
                self._release()
            raise
        return self

    def _come_to_rest(self) -> None:
        until_s = self._clock.now_s() + PATIENCE_S + self.limits.settling_s
        if self.busy:
            self.stop()
        while self.busy:
            if self._clock.now_s() > until_s:
                raise DeviceError(f"{self.name} must come to rest when it is opened, but still moves: stop it.")
            self._clock.wait_until(self._clock.now_s() + LOOK_EVERY_S)

    # The protocol of an actuator.

    @property
    def busy(self) -> bool:
        """Whether the actuator moves."""
        with self._line:
            moving, motion = bool(self._asked(self._moving)), self._motion
            if motion is None:
                return moving
            self._seen |= moving
            if not moving and self._has_ended(motion):
                self._motion = None
                return self._continues_home() if motion.to_mm is None else self._rests(motion, motion.to_mm)
            if self._clock.now_s() > motion.until_s:
                self.stop()
                raise DeviceError(
                    f"{self.name} must end its motion in time, but still moves: it was stopped; check that "
                    "nothing blocks it, and that speed_mm_s and settling_s are those of the stage."
                )
            return True

    def _has_ended(self, motion: _Motion) -> bool:
        """Whether a stage that reports no motion has ended its motion, rather than not begun it or reported it wrongly.

        At its target, it has if it has reported motion before or stands still. Elsewhere, it may as well creep along a
        ramp, and must stand still for as long as a ramp may last.
        """
        held_s = self._held_s()
        if motion.to_mm is None:
            return held_s >= self._still_s
        if abs(self._now_mm - motion.to_mm) <= self._near_mm + LOST_MM:
            return self._seen or held_s >= self._still_s
        return held_s >= self._still_s + self.limits.settling_s

    def _stands_still(self) -> bool:
        return self._held_s() >= self._still_s

    def _held_s(self) -> float:
        """Query the position, and state for how long it has been held."""
        # Until the question: on a busy computer, the answer may be old when it is looked at.
        asked_s = self._clock.now_s()
        self._at_mm()
        return asked_s - self._since_s

    def _continues_home(self) -> bool:
        """Move from the reference to position 0, if they are not the same; return whether the stage moves on."""
        at_mm = self._at_mm()
        if abs(at_mm) <= self._near_mm:
            return False
        self._start(at_mm, 0.0, min(HOMING_MM_S, self.limits.speed_mm_s))
        return True

    def _rests(self, motion: _Motion, to_mm: float) -> bool:
        """Compare position and duration of a motion with its target and speed; return that the stage does not move."""
        at_mm = self._at_mm()
        way_mm, took_s = abs(at_mm - motion.from_mm), self._since_s - motion.began_s
        sure_mm = way_mm - min(self._jump_mm, REFRESHED_S * motion.speed_mm_s)
        if abs(at_mm - to_mm) > self._near_mm + LOST_MM:
            words = f"it was sent to {to_mm:g} mm and rests at {at_mm:g} mm: steps were lost, or it was stopped by hand"
            self._fault = Alarm("lost", f"{words}; home the stage")
        elif sure_mm > 4.0 * self._still_mm and TOO_FAST * took_s * motion.speed_mm_s < sure_mm:
            words = f"it was told {motion.speed_mm_s:g} mm/s, but went {way_mm:.3g} mm within {took_s:.2g} s"
            why = "it does not keep its speed, states its target as its position, or has other units than stated"
            self._fault = Alarm("fast", f"{words}: {why}")
        return False

    @property
    def _near_mm(self) -> float:
        limits = self.limits
        return limits.accuracy_mm + 0.5 * limits.encoder_step_mm + limits.repeatability_mm + 1e-6

    @property
    def alarm(self) -> Alarm | None:
        """Lost steps or a wrong speed until the stage is homed, or the device's last refusal."""
        return self._fault or self._refusal

    def home(self) -> None:
        """Go to the reference, then to position 0."""
        with self._line:
            self._ready()
            stops, self._fault = self._stops, None
            self._do(self._go_home)
            began_s, self._still_mm, self._still_s = self._clock.now_s(), STILL_MM, STILL_S
            self._went(stops, _Motion(None, began_s, began_s + HOME_S))

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        check_move(self.limits, to_mm, speed_mm_s)
        # Nobody looks between the begin of the way and the command: what was gone then would be of no motion.
        with self._line:
            self._ready()
            if self._fault is not None:
                raise DeviceError(f"{self.name} must know its position, but {self._fault.words}. Nothing was moved.")
            at_mm, low_mm, high_mm = self._at_mm(), self.limits.lower_mm, self.limits.upper_mm
            if not (
                self._homed and low_mm - LOST_MM <= at_mm + self._near_mm and at_mm - self._near_mm <= high_mm + LOST_MM
            ):
                has = (
                    f"stands at {at_mm:g} mm"
                    if self._homed
                    else "has not searched its reference since it was switched on"
                )
                raise DeviceError(
                    f"{self.name} must stand within its range of {low_mm:g} to {high_mm:g} mm before it moves, but "
                    f"{has}: home it, and check zero_mm and the units. Nothing was moved."
                )
            self._start(at_mm, to_mm, speed_mm_s)

    def stop(self) -> None:
        """Stop the motion at once, without waiting for a question that is being asked."""
        self._stops += 1
        self._motion = None
        try:
            self._halt()
        except Exception as error:
            raise DeviceError(
                f"{self.name} must stop, but could not be told to ({in_a_line(error)}): it may still move; use the "
                "emergency stop."
            ) from error

    def readings(self) -> tuple[Reading, ...]:
        """The present position only, because the device does not store earlier positions."""
        with self._line:
            asked_s = self._clock.now_s()
            position_mm = self._at_mm()
            got_s = self._clock.now_s()
            moving = self.busy
        return (Reading(0.5 * (asked_s + got_s), asked_s, got_s, position_mm, moving),)

    def close(self) -> None:
        """Stop and close the connection; a connection that is lost already is closed without another error."""
        if self._closed:
            return
        self._closed = True
        with suppress(Exception):
            self.stop()
        with suppress(Exception), self._line:
            self._release()

    def _ready(self) -> None:
        if self.busy:
            raise StateError("The stage must be at rest before a new motion, but is still moving: stop it first.")

    def _start(self, at_mm: float, to_mm: float, speed_mm_s: float) -> None:
        stops, settings, began_s = self._stops, self._settings, self._clock.now_s()
        seconds = abs(to_mm - at_mm) / speed_mm_s + self.limits.settling_s
        self._still_mm = STILL_SHARE * STILL_S * speed_mm_s
        # An encoder shows no motion between two of its steps.
        self._still_s = max(STILL_S, 2.0 * self.limits.encoder_step_mm / speed_mm_s)
        self._do(lambda: self._begin(settings.zero_mm + settings.sign * to_mm, speed_mm_s))
        until_s = self._clock.now_s() + PATIENCE * seconds + PATIENCE_S + self._still_s
        self._went(stops, _Motion(to_mm, began_s, until_s, at_mm, speed_mm_s))

    def _went(self, stops: int, motion: _Motion) -> None:
        """Note a motion that was begun; a stop that came while it was begun is repeated, because it came too early."""
        self._motion, self._seen, self._since_s = motion, False, self._clock.now_s()
        self._held_mm, self._jump_mm = self._now_mm, 0.0
        if self._stops != stops:
            self.stop()

    def _at_mm(self) -> float:
        position_mm = self._asked(self._position_mm)
        if not isfinite(position_mm):
            raise DeviceError(f"{self.name} must answer with its position, but answered {position_mm}.")
        at_mm = (position_mm - self._settings.zero_mm) * self._settings.sign + 0.0  # no minus before a zero
        self._jump_mm, self._now_mm = max(self._jump_mm, abs(at_mm - self._now_mm)), at_mm
        if abs(at_mm - self._held_mm) > self._still_mm:
            self._held_mm, self._since_s = at_mm, self._clock.now_s()
        return at_mm

    def _do(self, act: Callable[[], None]) -> None:
        """Send a command; an accepted command ends an earlier refusal."""
        self._asked(act)
        self._refusal = None

    def _asked(self, act: Callable[[], T]) -> T:
        try:
            with self._line:
                return act()
        except FingervisionError:
            raise
        except RefusedError as error:
            self._refusal = Alarm(error.code, error.words)
            raise DeviceError(
                f"{self.name} must accept what it is told, but reported {error.words}: remove the cause, and home the "
                "stage if its position is unknown."
            ) from error
        except Exception as error:  # serial ports, VISA and each library raise exceptions of their own classes
            raise DeviceError(
                f"{self.name} must answer a request, but did not ({in_a_line(error)}): check its cable."
            ) from error


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without opening the test bed."""
    return FreeMoves(stage_limits(section))


class SetpointAxis(SingleAxis):
    """A `SingleAxis` whose subclass states whether the device takes a speed, and how it is set to a position."""

    # Begin, end, speed and time of the beginning of the ramp.
    _ramp: tuple[float, float, float, float] | None = None

    @abstractmethod
    def _takes_speed(self, speed_mm_s: float) -> bool:
        """Tell the device the speed of the next motion; return False if it cannot be told."""

    @abstractmethod
    def _put(self, to_mm: float) -> None:
        """Begin to move to a position."""

    @abstractmethod
    def _settled(self) -> bool:
        """Whether the device has reached the position to which it was set last."""

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        if self._takes_speed(speed_mm_s):
            self._put(to_mm)
        else:
            self._ramp = (self._position_mm(), to_mm, speed_mm_s, self._clock.now_s())

    def _moving(self) -> bool:
        ramp, stops = self._ramp, self._stops
        if not self._settled():
            return True
        if ramp is None:
            return False
        from_mm, to_mm, speed_mm_s, began_s = ramp
        left = 1.0 - speed_mm_s * (self._clock.now_s() - began_s) / max(abs(to_mm - from_mm), 1e-12)
        self._put(to_mm - max(left, 0.0) * (to_mm - from_mm))
        if left <= 0.0:
            self._ramp = None
        if self._stops != stops:  # a stop came while the position was being sent
            self._halt()
        return True
