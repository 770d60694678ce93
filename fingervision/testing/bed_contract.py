"""Contract tests of actuators, force sensors and cameras, run through a test bed that contains them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Self

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.testbed import bed_factory
from fingervision.testbed.bed import Bed
from fingervision.testbed.force_sensor import Reading
from fingervision.testing.contract import NotApplicable, hold

WAIT_S, PATIENCE_S = 0.01, 10.0
# The search of a reference goes over the whole range, at the device's own speed.
HOMES_WITHIN_S = 120.0
"""Time between two requests for a position, and time after which a motion of a millimetre is considered endless."""
SPEED_MM_S, SLOW_MM_S, FAR_MM = 2.0, 0.5, 5.0
STOPS_WITHIN_S = 0.5
"""Longest time to stop; a motor brakes from 0.5 mm/s in a tenth of this time, and the rest is for a response over a
slow line."""
ROUNDING_MM = 1e-6
"""Tolerance of one nanometre for rounding errors of transmitted numbers. The limits of a real stage declare all further
tolerances: accuracy_mm, encoder_step_mm, repeatability_mm and settling_s."""


def bed_at(path: str | Path) -> Bed:
    """Open the test bed that a file describes; the `kind` entries of the file may name plug-ins or Python files."""
    return bed_factory.open_bed(str(path))


class _BedContract:
    """Tests of a device through its test bed; define `open_bed`, or pass an open test bed with `of`."""

    _open: Bed | None = None

    def open_bed(self) -> Bed:
        """Open a test bed that contains the part; to be defined by the subclass."""
        raise NotImplementedError

    @classmethod
    def of(cls, bed: Bed) -> Self:
        """Return the tests for a test bed that is already open, and that stays open afterwards."""
        contract = cls()
        contract._open = bed
        return contract

    @contextmanager
    def _bed(self) -> Iterator[Bed]:
        bed = self._open or self.open_bed()
        try:
            yield bed
        finally:
            if self._open is None:
                bed.close()


class ActuatorContract(_BedContract):
    """Tests of an actuator; define `open_bed()`.

    The motor moves by up to a millimetre, and once towards 5 mm until it is stopped: make sure that nothing is in its
    way. The tolerances follow from the properties that the actuator's `limits` declare. An actuator without declared
    properties must stop within a nanometre of its target, and a motion must take its nominal duration within two
    readings (20 ms). See `StageLimits` for accuracy_mm, encoder_step_mm, repeatability_mm (of readings at rest, and of
    the reference) and settling_s (acceleration ramps and settling).

    `has_motor` is False for an actuator that does not move at a commanded speed, such as a screw turned by hand.
    """

    has_motor = True

    def test_it_goes_where_it_is_sent(self) -> None:
        """The stage stops within its accuracy, plus one encoder step, of its target."""
        with self._bed() as bed:
            for share in (0.5, -0.2, 0.0):
                to_mm = _place_mm(bed, share)
                bed.actuator.move(to_mm, _speed_mm_s(bed, SPEED_MM_S))
                at_mm = _until_rest(bed)[-1].value
                hold(
                    abs(at_mm - to_mm) <= _near_mm(bed),
                    f"{bed.actuator.name} must come to rest within {_near_mm(bed):.3g} mm of {to_mm:g} mm, but rests "
                    f"at {at_mm:g} mm.",
                )

    def test_a_motion_takes_the_time_that_its_speed_says(self) -> None:
        """By the actuator's clock, a motion's duration agrees with its speed within the accuracy of its end points."""
        self._needs_motor()
        with self._bed() as bed:
            before = bed.actuator.readings()[-1:]
            speed_mm_s, to_mm = _speed_mm_s(bed, SPEED_MM_S), _place_mm(bed, 1.0)
            expected_s = abs(to_mm - before[0].value) / speed_mm_s
            bed.actuator.move(to_mm, speed_mm_s)
            took_s = _moved_s(before + _until_rest(bed), _still_mm(bed))
            within_s = (2.0 * bed.actuator.limits.accuracy_mm + _known_mm(bed, speed_mm_s)) / speed_mm_s
            hold(
                abs(took_s - expected_s) <= within_s,
                f"{bed.actuator.name} must move for {expected_s:.3g} s +-{within_s:.2g} s, but took {took_s:.3g} s.",
            )

    def test_homing_ends_at_zero(self) -> None:
        """After homing, the reference is position 0."""
        with self._bed() as bed:
            bed.actuator.move(_place_mm(bed, 0.7), _speed_mm_s(bed, SPEED_MM_S))
            _until_rest(bed)
            bed.actuator.home()
            at_mm = _until_rest(bed, HOMES_WITHIN_S)[-1].value
            hold(
                abs(at_mm) <= _still_mm(bed),
                f"{bed.actuator.name} must rest within {_still_mm(bed):.3g} mm of 0 after homing, but rests at "
                f"{at_mm:g} mm: state its repeatability_mm.",
            )

    def test_a_jog_ends_with_a_stop(self) -> None:
        """A jog moves at its speed until it is stopped; then the stage is at rest."""
        self._needs_motor()
        with self._bed() as bed:
            before = bed.actuator.readings()[-1:]
            speed_mm_s = _speed_mm_s(bed, SLOW_MM_S)
            bed.actuator.jog(speed_mm_s)
            before += _watched(bed, 1.0)
            hold(
                bed.actuator.busy,
                f"{bed.actuator.name} must jog until it is stopped, but is at rest ({bed.actuator.alarm}).",
            )
            bed.actuator.stop()
            asked_s = bed.clock.now_s()
            readings = before + _until_rest(bed)
            stopping_s = bed.clock.now_s() - asked_s
            name = bed.actuator.name
            stops_within_s = STOPS_WITHIN_S + bed.actuator.limits.settling_s
            hold(
                stopping_s < stops_within_s,
                f"{name} must come to rest within {stops_within_s:g} s after a stop, but moved on for {stopping_s:.2g} "
                "s.",
            )
            went_mm, due_mm = (
                readings[-1].value - before[0].value,
                speed_mm_s * _moved_s(readings, _still_mm(bed)),
            )
            hold(
                abs(went_mm - due_mm) <= _known_mm(bed, speed_mm_s),
                f"{bed.actuator.name} must move by {due_mm:.3g} mm at {speed_mm_s:g} mm/s, but moved by {went_mm:.3g} "
                "mm.",
            )
            _wait(bed, 0.5)
            later_mm = bed.actuator.readings()[-1].value
            hold(
                abs(later_mm - readings[-1].value) <= _still_mm(bed),
                f"{bed.actuator.name} must be at rest after a stop, but moved on by "
                f"{later_mm - readings[-1].value:.3g} mm.",
            )

    def test_readings_come_in_order_and_between_question_and_answer(self) -> None:
        """Each call returns the readings up to the present, in order, with time bounds by the test bed's clock."""
        with self._bed() as bed:
            bed.actuator.move(_place_mm(bed, 0.5), _speed_mm_s(bed, 1.0))
            _check_order(bed, bed.actuator.readings, bed.actuator.name)

    def test_beyond_its_limits_nothing_moves(self) -> None:
        """A target or speed beyond the limits is refused with a sentence, and the stage stays at rest."""
        with self._bed() as bed:
            limits, before_mm = bed.actuator.limits, bed.actuator.readings()[-1].value
            speed_mm_s = _speed_mm_s(bed, 1.0)
            for to_mm, mm_s in (
                (limits.upper_mm + 0.1, speed_mm_s),
                (limits.lower_mm - 0.1, speed_mm_s),
                (before_mm, limits.speed_mm_s * 1.01),
            ):
                move = partial(bed.actuator.move, to_mm, mm_s)
                _refused(move, f"a move to {to_mm:g} mm at {mm_s:g} mm/s")
            hold(not bed.actuator.busy, f"{bed.actuator.name} must be at rest after a refused motion, but moves.")
            after_mm = bed.actuator.readings()[-1].value
            hold(
                abs(after_mm - before_mm) <= _still_mm(bed),
                f"{bed.actuator.name} must not move when it refuses a motion, but moved to {after_mm:g} mm.",
            )

    def test_a_busy_actuator_refuses_another_motion(self) -> None:
        """A second motion is refused during a motion; after a stop, the next motion is accepted."""
        self._needs_motor()
        with self._bed() as bed:
            bed.actuator.move(_place_mm(bed, FAR_MM), _speed_mm_s(bed, SLOW_MM_S))
            _refused(lambda: bed.actuator.move(_place_mm(bed, 0.0), _speed_mm_s(bed, 1.0)), "a move while it is busy")
            bed.actuator.stop()

    def test_closing_twice_is_allowed(self) -> None:
        """Closing twice is allowed: the second call does nothing."""
        with self._bed() as bed:
            bed.close()
            bed.close()

    def _needs_motor(self) -> None:
        if not self.has_motor:
            raise NotApplicable("a stage turned by hand has no set speed, and is at rest when its reading is typed in")


class ForceSensorContract(_BedContract):
    """Tests of a force sensor; define `open_bed()`."""

    def test_forces_come_in_order_and_within_the_full_scale(self) -> None:
        """Each call returns the forces up to the present, in order; no force exceeds the full scale."""
        with self._bed() as bed:
            sensor = bed.force_sensor
            if sensor is None:
                raise NotApplicable("this test bed has no force sensor")
            seen = _check_order(bed, sensor.readings, sensor.name, asked=False)
            largest = max(abs(reading.value) for reading in seen)
            hold(
                largest <= sensor.full_scale_n,
                f"{sensor.name} must return forces up to its full scale of {sensor.full_scale_n:g} N, but returned "
                f"{largest:g} N.",
            )


class CameraContract(_BedContract):
    """Tests of a camera; define `open_bed()`."""

    def test_frames_come_in_order_after_their_exposure(self) -> None:
        """Frame numbers are consecutive, times increase, and pictures agree with the camera's description."""
        with self._bed() as bed:
            camera = bed.camera
            if camera is None:
                raise NotApplicable("this test bed has no camera")
            shots = [camera.next() for _ in range(5)]
            indices = [shot.index for shot in shots]
            hold(
                indices == list(range(indices[0], indices[0] + 5)),
                f"Frame numbers must be consecutive, but are {indices}.",
            )
            for a, b in pairwise(shots):
                hold(
                    a.device_s < b.device_s and a.arrived_s < b.arrived_s,
                    f"Times must increase from frame {a.index} to {b.index}, but are {a.device_s:g} and {b.device_s:g} "
                    f"s on the camera's clock, {a.arrived_s:g} and {b.arrived_s:g} s on the test bed's clock.",
                )
            item = shots[-1].item()
            hold(item.time_s == shots[-1].device_s, "A frame must have the time of its exposure, but has another time.")
            described = camera.description
            if isinstance(item, Frame):
                size = item.width_px, item.height_px
                hold(
                    size == (described.width_px, described.height_px),
                    f"Frames must be {described.width_px} x {described.height_px} px, as described, but one is {size}.",
                )
            least_s, u_s = camera.latency.least_s, camera.latency.u_s
            hold(least_s >= 0.0 and u_s >= 0.0, f"A latency must not be negative, but is {least_s:g} s +-{u_s:g} s.")


def _place_mm(bed: Bed, by_mm: float) -> float:
    """The position `by_mm` away from the present one, clipped to the limits of the test bed (mm)."""
    low, high = bed.limits.lower_mm, bed.limits.upper_mm
    middle = min(max(0.0, low), high)
    return min(max(middle + by_mm, low), high)


def _speed_mm_s(bed: Bed, wanted_mm_s: float) -> float:
    return min(wanted_mm_s, bed.actuator.limits.speed_mm_s, bed.limits.speed_mm_s)


def _near_mm(bed: Bed) -> float:
    limits = bed.actuator.limits
    return limits.accuracy_mm + 0.5 * limits.encoder_step_mm + limits.repeatability_mm + ROUNDING_MM


def _still_mm(bed: Bed) -> float:
    """Allowed difference (mm) of two readings at rest, and of a reading at the reference from 0."""
    return bed.actuator.limits.repeatability_mm + ROUNDING_MM


def _known_mm(bed: Bed, speed_mm_s: float) -> float:
    """Uncertainty (mm) of a motion's length from readings: encoder steps, scatter, and uncertain times.

    Start and end of a motion each lie between two readings. The distance that the stage may move between these
    readings, and while it settles, is added.
    """
    limits = bed.actuator.limits
    return limits.encoder_step_mm + 2.0 * limits.repeatability_mm + (2.0 * WAIT_S + limits.settling_s) * speed_mm_s


def _wait(bed: Bed, seconds: float) -> None:
    bed.clock.wait_until(bed.clock.now_s() + seconds)


def _until_rest(bed: Bed, within_s: float = PATIENCE_S) -> tuple[Reading, ...]:
    """Collect readings up to the end of the motion; the last reading is at rest."""
    until_s = bed.clock.now_s() + within_s
    seen: list[Reading] = []
    while bed.actuator.busy:
        seen += _watched(bed, WAIT_S)
        hold(
            bed.clock.now_s() < until_s,
            f"{bed.actuator.name} must end its motion by itself, but has moved for {within_s:g} s.",
        )
    return (*seen, *bed.actuator.readings())


def _watched(bed: Bed, seconds: float) -> tuple[Reading, ...]:
    """Collect readings for some seconds; an actuator that does not send readings by itself is asked frequently."""
    seen: list[Reading] = []
    until_s = bed.clock.now_s() + seconds
    while bed.clock.now_s() < until_s:
        _wait(bed, WAIT_S)
        seen += bed.actuator.readings()
    return tuple(seen)


def _moved_s(readings: tuple[Reading, ...], still_mm: float) -> float:
    """Duration of the motion by the actuator's own clock, which a slow computer does not change (seconds)."""
    first, last = readings[0].value, readings[-1].value
    began_s = max(each.device_s for each in readings if abs(each.value - first) <= still_mm)
    ended_s = min(each.device_s for each in readings if abs(each.value - last) <= still_mm)
    return ended_s - began_s


def _check_order(
    bed: Bed, readings: Callable[[], tuple[Reading, ...]], name: str, *, asked: bool = True
) -> list[Reading]:
    """Check the order of readings.

    If `asked` is true, the newest reading must have been taken on request; otherwise it may have been streamed before.
    """
    seen: list[Reading] = []
    for _ in range(5):
        _wait(bed, 0.04)
        before_s = bed.clock.now_s()
        given = readings()
        hold(bool(given), f"{name} must return at least one reading at each call, but returned none.")
        newest, now_s = given[-1], bed.clock.now_s()
        hold(
            not asked or before_s <= newest.asked_s <= newest.got_s <= now_s,
            f"{name} must take its newest reading between request and answer ({before_s:.6g} to {now_s:.6g} s), but "
            f"states {newest.asked_s:.6g} to {newest.got_s:.6g} s.",
        )
        seen += given
    hold(
        all(a.device_s < b.device_s for a, b in pairwise(seen)) and all(one.asked_s <= one.got_s for one in seen),
        f"{name} must return its readings in the order of their times, but does not.",
    )
    return seen


def _refused(act: Callable[[], None], what: str) -> None:
    try:
        act()
    except FingervisionError:
        return
    hold(False, f"The actuator must refuse {what} with a FingervisionError, but begins it.")
