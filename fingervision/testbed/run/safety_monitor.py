"""Monitor every frame of a motion against the limits; the gap's motion over the model's tells wrong units."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from time import sleep

import numpy as np

from fingervision.domain.errors import DeviceError, LimitError, StateError
from fingervision.domain.frame import LostFrame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.model import Model
from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.bed import Bed
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.recipe_kinds import Close, Go, Leg
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.run_record import RunRecord
from fingervision.testbed.run.synchronised_acquisition import Look, Sight

# Ratio of the gap's motion to that of the model: what tells wrong units of a stage that commands and reports alike.

LARGEST_RATIO = 3.0
"""Largest ratio, or its inverse, that the effects of the catalogue cause together (1.3 * 1.3 * 1.2 = 2.03), with a
margin; units that are confused differ by 10, 25.4, 100 or 1000."""
FEWEST, SURE = 5, 30.0
"""Frames, and standard deviations, from which on a ratio counts: Student's t with three degrees of freedom exceeds 30
by chance four times in 100 000."""


class MotionRatio:
    """Fits a line to the gaps of one motion over the gaps that the model predicts.

    Parameters
    ----------
    model : Model
        Model of the gripper.
    limits : SoftLimits
        Limits of the test bed, within which the model is computed.
    """

    def __init__(self, model: Model, limits: SoftLimits) -> None:
        self._inputs_mm = limits.tabulated_mm
        self._gaps_mm = model.respond(self._inputs_mm).gap_mm
        self.begin()

    def begin(self) -> None:
        """Begin another motion."""
        self._seen: list[tuple[float, float]] = []
        self._ratio, self._u = 0.0, inf

    def add(self, input_mm: float, gap_mm: float) -> None:
        """Add a frame, and fit the line."""
        self._seen.append((float(np.interp(input_mm, self._inputs_mm, self._gaps_mm)), gap_mm))
        predicted, seen = np.array(self._seen).T
        if len(seen) >= FEWEST and np.ptp(predicted) > 0.0:
            (x, both), (_, y) = np.cov(predicted, seen).tolist()
            self._ratio = both / x
            self._u = sqrt(max(y - self._ratio * both, 0.0) / (len(seen) - 2) / x)

    @property
    def interval(self) -> tuple[float, float]:
        """Ratios within which that of this motion surely lies."""
        return self._ratio - SURE * self._u, self._ratio + SURE * self._u

    @property
    def words(self) -> str:
        """The ratio and what to check, as a sentence without its end."""
        return (
            f"the gap moved {self._ratio:.3g} times as far as the model predicts: check the units of the stage "
            "(such as per_mm, counts_per_mm or microstep_mm), the scale px_per_mm, and the units of the model"
        )


# Number of frames of which at least one must show the fingers.
FRAMES_TO_FIND_FINGERS = 3
# Interval at which a paused simulation without a pace checks whether the run was continued.
LOOK_EVERY_S = 0.05

Say = Callable[[str], None]


@dataclass(slots=True)
class Watch:
    """Takes frames, measures and records them, and stops the motor at a limit.

    Parameters
    ----------
    bed : Bed
        The test bed that is monitored.
    sight : Sight
        Acquisition of frames and instrument readings.
    record : RunRecord
        Record of the run.
    controls : Controls
        Commands of the user.
    below_force_n : float
        Force limit of the recipe.
    say : callable
        Called with sentences for the person at the test bed.
    leg : Leg or None
        Segment that is being executed.
    paused_s : float
        Total duration of pauses.
    ratio : MotionRatio or None
        Comparison of the gap's motion with the model's; None without a model, or without a real part.
    """

    bed: Bed
    sight: Sight
    record: RunRecord
    controls: Controls
    below_force_n: float
    say: Say
    leg: Leg | None = None
    paused_s: float = 0.0
    ratio: MotionRatio | None = None

    @property
    def now_s(self) -> float:
        """Time on the test bed's clock without pauses (s)."""
        return self.bed.clock.now_s() - self.paused_s

    # Frames.

    def look(self) -> Look:
        """Take one frame without measuring it, and check alarm, force and the user's commands.

        Raises
        ------
        StateError
            The user ended the run.
        DeviceError, LimitError
            The actuator has an alarm, or the force is beyond a limit.
        """
        self._end_if_stopped()
        look = self.sight.look()
        # Between the last reading in motion and the first one after a stop, nobody knows where the stage was.
        self._end_if_stopped()
        limit_n = inf if self._closes else min(self.below_force_n, self.bed.limits.force_n)
        self.bed.check(look.force_now_n, limit_n, f" at {self.sight.position.newest:z.3f} mm")
        return look

    def see(self, *, record: bool) -> tuple[Look, GapRow]:
        """Take a frame, measure it, and record it.

        Raises
        ------
        DeviceError, LimitError, StateError
            As in `look`, or the gap is beyond its limit.
        """
        look = self.look()
        there = self.record.there_already() if record else None
        # Contact ends a motion by what was seen in the frame at once, which the table need not repeat.
        if there is not None and not self._closes:
            return look, there
        item = look.shot.item()
        self.sight.know(self.record.camera(wait=self.bed.replays))
        measured, outcome = self.sight.measure(item)
        if there is not None:
            return look, measured
        step = 0 if self.leg is None else self.leg.step
        if not record:
            pass
        elif isinstance(item, LostFrame) or isinstance(outcome, LostFrame):
            self.record.lose(step)
        else:
            self.record.add(look, item, (self.sight.settings, outcome), step)
        self.record.write()
        gap_mm = measured.gap_mm
        if self.ratio is not None and gap_mm is not None and self.leg is not None and isinstance(self.leg.act, Go):
            self.ratio.add(self.sight.position.at(look.exposed_s, at_once=True) or 0.0, gap_mm)
            if self.ratio.interval[0] > LARGEST_RATIO:
                raise DeviceError(f"The test bed must move as stated, but {self.ratio.words}. The motor was stopped.")
        if gap_mm is not None and gap_mm < self.bed.limits.gap_mm and not self._closes:
            raise LimitError(
                f"The gap must stay above {self.bed.limits.gap_mm:g} mm, but is {gap_mm:z.4f} mm at "
                f"{self.sight.position.newest:z.3f} mm: the motor was stopped."
            )
        return look, measured

    def catch_up(self) -> None:
        """Record the frames that wait because the computer is busy: they show the motion that has ended."""
        began_s = self.bed.clock.now_s()
        while self.sight.is_behind() and self.see(record=True)[0].exposed_s < began_s:
            pass

    def find_fingers(self) -> None:
        """Refuse to continue if the camera does not show both fingers."""
        words = ""
        for _ in range(FRAMES_TO_FIND_FINGERS):
            measured, outcome = self.sight.measure(self.look().shot.item())
            if measured.status is Status.OK:
                return
            words = "" if isinstance(outcome, GapMeasurement) else outcome.words
        raise DeviceError(
            f"The camera must show both fingers before anything moves, but does not: {words} Bring both fingers into "
            "the picture (camera, light, focus; `fingervision bed home`, if the stage stands elsewhere), and run the "
            "recipe again."
        )

    def _end_if_stopped(self) -> None:
        if self.controls.stopped:
            raise StateError("The run was stopped, and the motor is at rest. The same command continues the run.")

    @property
    def _closes(self) -> bool:
        """Whether the present segment may end by a force or by contact."""
        return self.leg is not None and isinstance(self.leg.act, Close)

    # Motions.

    def follow(
        self, begin: Callable[[], None], *, record: bool, until: Callable[[Look, GapRow], bool] | None = None
    ) -> None:
        """Begin a motion and monitor it until the stage is at rest; after a pause the motion is started again.

        Parameters
        ----------
        begin : callable
            Begins the motion from the present position of the stage.
        record : bool
            Whether the frames of the motion are recorded.
        until : callable, optional
            Ends the motion when it returns True for a frame.
        """
        while True:
            self.wait_while_paused(record=record)
            self.controls.halted = broken_off = False
            self._end_if_stopped()
            begin()
            while self.bed.actuator.busy:
                seen = self.see(record=record)
                if until is not None and until(*seen):
                    self.bed.actuator.stop()
                    while self.bed.actuator.busy:
                        self.see(record=record)
                    return
                broken_off |= self.wait_while_paused(record=record)
            # The time of a simulation stops during a pause, so that its motion was not interrupted.
            if self.bed.replays or not (broken_off or self.controls.halted):
                return

    def wait_while_paused(self, *, record: bool) -> bool:
        """Wait while the run is paused; return whether there was a pause."""
        if not self.controls.paused:
            return False
        self.say("The run is paused: type p and Enter to continue it, or q and Enter to end it.")
        began_s = self.bed.clock.now_s()
        if self.bed.replays:
            while self.controls.waits:
                sleep(LOOK_EVERY_S)
        else:
            self.bed.actuator.stop()
            while self.controls.waits:
                self.see(record=record)
        self.paused_s += self.bed.clock.now_s() - began_s
        return True
