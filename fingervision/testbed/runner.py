"""A plan on a bed: one leg after the other, every frame looked at, the motor stopped before anything else."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from math import sin, tau
from typing import Any

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.samples_csv import MM_PLACES, SampleRow
from fingervision.testbed import by_hand
from fingervision.testbed.bed import Bed
from fingervision.testbed.controls import Controls
from fingervision.testbed.legs import Close, Frames, Go, Leg, Rezero, Shift, Slot, Stand, Swing, Turn
from fingervision.testbed.plan import Plan
from fingervision.testbed.reference_slot import measured_slot
from fingervision.testbed.run_folder import BedRunFolder
from fingervision.testbed.sight import Look, Sight

# The clocks are joined by so many frames before anything moves; the fingers must be seen in one of the last.
FIRST_FRAMES, FRAMES_TO_FIND_FINGERS = 75, 3
# A recorded run begins at rest.
REST_FRAMES = 5
# The picture is still when so many frames in a row differ by less than so many times their own uncertainty.
STILL_FRAMES, STILL_SIGMAS = 4, 4.0
# A picture that is not still by then is measured as it is, and said so.
STILL_WITHIN_S = 5.0
# A new reference is only as good as the rest before it.
REST_AFTER_HOMING_S = 1.0
# A run that follows another begins at least so much after it.
PAUSE_S = 5.0
# A sine is driven in pieces of so many frames.
SWING_FRAMES = 3
SLOT_FRAMES = 10

Progress = Callable[[float, float], None]
Say = Callable[[str], None]


class StoppedError(FingervisionError):
    """The user ended the run."""


@dataclass(frozen=True, slots=True)
class Counts:
    """What became of a run's frames."""

    recorded: int
    with_gap: int
    lost: int


@dataclass(slots=True)
class Runner:
    """Runs a plan from where the folder's rows end.

    A bed that replays is taken through the whole plan again; what is in the folder already is not drawn, measured or
    written a second time. On any other bed the run goes on with the leg in which it broke off, as a run of its own.

    Parameters
    ----------
    bed : Bed
        Where.
    plan : Plan
        What.
    sight : Sight
        The bed's eyes.
    folder : BedRunFolder
        Where it is written.
    controls : Controls
        What the user wants.
    below_force_n : float
        The recipe's limit of force.
    on_progress : callable
        Told the seconds done, and those expected in all.
    say : callable
        Told what a person at the bed shall know, in sentences.
    """

    bed: Bed
    plan: Plan
    sight: Sight
    folder: BedRunFolder
    controls: Controls
    below_force_n: float
    on_progress: Progress = field(default=lambda done, total: None)
    say: Say = field(default=lambda words: None)
    run: int = 1
    part: str = ""
    _rows: int = 0
    _with_gap: int = 0
    _lost: int = 0
    _events: int = 0
    _zero_s: float | None = None
    _base_s: float = 0.0
    _leg: Leg | None = None
    _closing_below_mm: float = 0.0
    _waiting: deque[tuple[SampleRow, float]] = field(default_factory=deque)
    slots: list[dict[str, float]] = field(default_factory=list)

    def follow(self, last: SampleRow) -> None:
        """Go on from the last row of an earlier run; to be called first."""
        self.run = run_number(last) + 1
        if self.bed.replays:
            # The simulated camera's clock goes on.
            self._zero_s = last.camera_s - last.time_s
        else:
            # What has passed between two runs is known as well as the host's clock, and needs no better.
            self._base_s = last.time_s + max(PAUSE_S, self.bed.clock.now_s() - last.arrived_s)

    def execute(self) -> Counts:
        """Run it to its end.

        Raises
        ------
        StoppedError
            The user ended it.
        FingervisionError
            A limit was met, an instrument failed, or no fingers are in view; the motor stands then.
        """
        try:
            with self.controls.listening(self.bed.actuator.stop):
                self._execute()
        except BaseException:
            self.bed.actuator.stop()
            with suppress(FingervisionError):
                self._write(at_once=True)
            raise
        return Counts(self._rows, self._with_gap, self._lost)

    def _execute(self) -> None:
        if not self.bed.replays:
            # A real stage is sent to its reference first: where it stands nobody knows. Not without fingers in view.
            self._find_fingers(self._look())
            self.say(f"homed: {by_hand.home(self.bed):.3f} mm")
        for _ in range(FIRST_FRAMES):
            look = self._look()
        self._find_fingers(look)
        first = self._first_leg()
        total_s, done_s = sum(self.plan.seconds), sum(self.plan.seconds[:first])
        self._event("began", f"{len(self.plan.legs)} legs.")
        self._rest(first)
        for number, (leg, seconds) in enumerate(zip(self.plan.legs, self.plan.seconds, strict=True)):
            if number < first:
                continue
            self._leg = leg
            self._event("leg", f"Step {leg.step}: {_words(leg)}.", leg=number, step=leg.step, frame=self._rows)
            self._do(leg, number)
            done_s += seconds
            self.on_progress(done_s, total_s)
        self._write(at_once=True)
        joined = self._clocks()
        self._event("clocks", "The instruments' clocks beside the bed's.", **joined)
        self._event("ended", f"{self._rows} frames.")

    def _first_leg(self) -> int:
        """Leg to begin with: 0, or the one in which a bed that cannot replay broke off."""
        if self.bed.replays or not self.folder.resumed:
            return 0
        legs = [event for event in self.folder.events_done if event["event"] == "leg"]
        self._events = len(self.folder.events_done)
        self._rows = len(self.folder.rows)
        self._with_gap = sum(row.gap_mm is not None for row in self.folder.rows)
        if self.folder.rows:
            last = self.folder.rows[-1]
            self.run = run_number(last) + 1
            since_s = (datetime.now(UTC) - self.folder.began_at).total_seconds()
            self._base_s = max(last.time_s + 1.0, since_s)
        return int(legs[-1]["leg"]) if legs else 0

    def _do(self, leg: Leg, number: int) -> None:
        match leg.act:
            case Go(to_mm, speed, frames):
                self._go(to_mm, speed, frames)
            case Stand(seconds, frames):
                self._stand(seconds, frames)
            case Swing():
                self._swing(leg.act)
            case Close(speed, force_n):
                self._close(speed, force_n)
            case Slot(size_mm, u_size_mm):
                self._slot(size_mm, u_size_mm)
            case Rezero():
                self.bed.actuator.home()
                self._while_busy(record=False)
                self._stand(REST_AFTER_HOMING_S, 0)
                self._new_run(number, "")
            case Turn():
                self.bed.operator.turn_part()
                self._new_run(number, "" if self.part else " turned")
            case Shift():
                self.bed.operator.shift_picture()
                self._new_run(number, self.part)

    # Motions.

    def _go(self, to_mm: float, speed_mm_s: float, frames: Frames) -> None:
        while True:
            self.bed.actuator.move(to_mm, speed_mm_s)
            if self._while_busy(record=frames is None):
                break
        if frames is None:
            # A corner is seen: what has a memory remembers it, and no sample beside it tells where it was.
            self._seen(record=True)
        self._point(frames)

    def _while_busy(self, *, record: bool, until: Callable[[Look, GapRow], bool] | None = None) -> bool:
        """Look on until the stage stands; False where a pause made it stand, and the way is to be gone on with."""
        while self.bed.actuator.busy:
            look, row = self._seen(record=record)
            if until is not None and until(look, row):
                self.bed.actuator.stop()
                while self.bed.actuator.busy:
                    self._seen(record=record)
                return True
            if self._paused(record=record):
                return False
        return True

    def _stand(self, seconds: float, frames: Frames) -> None:
        until_s = self.bed.clock.now_s() + seconds
        while self.bed.clock.now_s() < until_s:
            self._seen(record=frames is None)
            self._paused(record=frames is None)
        self._point(frames)

    def _swing(self, swing: Swing) -> None:
        began_s, piece_s = self.bed.clock.now_s(), SWING_FRAMES / self.sight.rate_hz
        lasts_s = swing.cycles / swing.frequency_hz
        at_mm = swing.mean_mm
        while (since_s := self.bed.clock.now_s() - began_s) < lasts_s:
            then_s = min(since_s + piece_s, lasts_s)
            to_mm = swing.mean_mm + swing.amplitude_mm * sin(tau * swing.frequency_hz * then_s)
            if abs(to_mm - at_mm) > 1e-9 and then_s > since_s:
                self.bed.actuator.move(to_mm, max(abs(to_mm - at_mm) / (then_s - since_s), 1e-3))
                at_mm = to_mm
            self._while_busy(record=True)
            if self.bed.clock.now_s() - began_s <= since_s:
                self._seen(record=True)

    def _close(self, speed_mm_s: float, below_force_n: float) -> None:
        felt: list[str] = []

        def met(look: Look, row: GapRow) -> bool:
            if look.force_now_n is not None and abs(look.force_now_n) >= below_force_n:
                felt.append(f"the force of {below_force_n:g} N was reached")
            elif row.status is Status.TOUCHING:
                felt.append("the fingers touch in the picture")
            return bool(felt)

        while not felt:
            self.bed.actuator.move(self.bed.limits.lower_mm, speed_mm_s)
            if self._while_busy(record=True, until=met):
                break
        why = felt[0] if felt else "nothing was met down to the bed's limit of position"
        self._event("closed", f"Closing ended: {why}.", input_mm=self.sight.position.newest)

    # Points.

    def _point(self, frames: Frames) -> None:
        if not frames:
            return
        self._settle()
        for _ in range(frames):
            self._seen(record=True)
            self._paused(record=False)

    def _settle(self) -> None:
        """Wait until the picture is still."""
        until_s = self.bed.clock.now_s() + STILL_WITHIN_S
        last: list[GapRow] = []
        while self.bed.clock.now_s() < until_s:
            _, row = self._seen(record=False)
            last = [*last[-STILL_FRAMES + 1 :], row]
            if len(last) == STILL_FRAMES and _still(last):
                return
        self._event("not_still", f"The picture was not still after {STILL_WITHIN_S:g} s, and is measured as it is.")

    def _rest(self, leg: int) -> None:
        """Record the rest that a run begins with, if what follows is recorded continuously."""
        following = self.plan.legs[leg].act if leg < len(self.plan.legs) else None
        moves_on = isinstance(following, Swing | Close)
        if moves_on or (isinstance(following, Go | Stand) and following.frames is None):
            for _ in range(REST_FRAMES):
                self._seen(record=True)

    def _new_run(self, leg: int, part: str) -> None:
        self.run, self.part = self.run + 1, part
        self._rest(leg + 1)

    def _slot(self, size_mm: float, u_size_mm: float) -> None:
        self.bed.operator.put_in_slot(size_mm)
        self._look()
        items = [self._look().shot.item() for _ in range(SLOT_FRAMES)]
        self.bed.operator.take_out_slot()
        assert self.bed.scale is not None  # noqa: S101 - a sight was made of it
        found = measured_slot([item for item in items if isinstance(item, Frame)], size_mm, self.bed.scale)
        self.slots.append({"size_mm": size_mm, "u_size_mm": u_size_mm, **found})
        words = f"The slot of {size_mm:g} mm measures {found['measured_mm']:.4f} +- {found['u_random_mm']:.2g} mm."
        self._event("reference_slot", words, **self.slots[-1])
        self.say(words)
        self._find_fingers(self._look())

    # Frames.

    def _look(self) -> Look:
        """Look once, and stop the motor where a limit is met."""
        if self.controls.stopped.is_set():
            raise StoppedError("The run was stopped; the motor stands. The same command goes on with it.")
        look = self.sight.look()
        alarm = self.bed.actuator.alarm
        if alarm is not None:
            raise FingervisionError(f"The actuator has an alarm ({alarm.code}: {alarm.words}): the motor was stopped.")
        limit_n = min(self.below_force_n, self.bed.limits.force_n)
        if look.force_now_n is not None and abs(look.force_now_n) > limit_n and not isinstance(self._act, Close):
            raise FingervisionError(
                f"The force must stay below {limit_n:g} N, but is {look.force_now_n:.3g} N at "
                f"{self.sight.position.newest:.3f} mm: the motor was stopped."
            )
        return look

    @property
    def _act(self) -> object:
        return None if self._leg is None else self._leg.act

    def _seen(self, *, record: bool) -> tuple[Look, GapRow]:
        """Look, measure, and record."""
        look = self._look()
        if record and self._rows < len(self.folder.rows):
            row = self.folder.rows[self._rows]
            gap_row = GapRow(0, row.time_s, row.status, gap_mm=row.gap_mm, u_random_mm=row.u_random_mm)
            self._zero_s = row.camera_s - row.time_s
            self._count(row)
            return look, gap_row
        item = look.shot.item()
        measured, _ = self.sight.measure(item)
        if record and isinstance(item, Frame):
            if self._zero_s is None:
                self._zero_s = look.shot.device_s - self._base_s
            row = self._row(look, measured, self._zero_s)
            self.folder.add_picture(item, row.time_s)
            self._waiting.append((row, look.exposed_s))
            self._count(row)
        elif record:
            self._lost += 1
        self._write()
        gap_mm = measured.gap_mm
        if gap_mm is not None and gap_mm < self.bed.limits.gap_mm and not isinstance(self._act, Close):
            raise FingervisionError(
                f"The gap must stay above {self.bed.limits.gap_mm:g} mm, but is {gap_mm:.3g} mm at "
                f"{self.sight.position.newest:.3f} mm: the motor was stopped."
            )
        return look, measured

    def _write(self, *, at_once: bool = False) -> None:
        """Write the rows whose place between the encoder's steps is known by now."""
        while self._waiting:
            row, exposed_s = self._waiting[0]
            input_mm = self.sight.position.at(exposed_s, at_once=at_once)
            if input_mm is None:
                return
            self.folder.add_row(replace(row, input_mm=round(input_mm, MM_PLACES)))
            self._waiting.popleft()

    def _row(self, look: Look, measured: GapRow, zero_s: float) -> SampleRow:
        def rounded(value: float | None) -> float | None:
            return None if value is None else round(value, MM_PLACES)

        return SampleRow(
            run=f"{self.run}{self.part}",
            time_s=round(look.shot.device_s - zero_s, 6),
            input_mm=None,
            gap_mm=rounded(measured.gap_mm),
            left_mm=rounded(measured.left_mm),
            right_mm=rounded(measured.right_mm),
            u_gap_mm=rounded(measured.u_gap_mm),
            u_random_mm=rounded(measured.u_random_mm),
            force_n=look.force_n,
            status=measured.status,
            frame=self._rows,
            step=0 if self._leg is None else self._leg.step,
            encoder_mm=rounded(look.encoder_mm),
            camera_s=round(look.shot.device_s, 6),
            arrived_s=round(look.shot.arrived_s, 6),
        )

    def _count(self, row: SampleRow) -> None:
        self._rows += 1
        self._with_gap += row.gap_mm is not None

    def _find_fingers(self, look: Look) -> None:
        words = ""
        for _ in range(FRAMES_TO_FIND_FINGERS):
            measured, words = self.sight.measure(look.shot.item())
            if measured.status is Status.OK:
                return
            look = self._look()
        raise FingervisionError(
            f"The camera must see both fingers before anything moves, but does not: {words} Mend the view, and run the "
            "recipe again."
        )

    def _paused(self, *, record: bool) -> bool:
        """Wait while the user pauses; whether the stage was stopped for it."""
        if not self.controls.paused.is_set():
            return False
        self.say("Paused: p and Enter go on, q and Enter end the run.")
        while self.controls.paused.is_set() and not self.controls.stopped.is_set():
            if self.bed.replays:
                # Time stands still in a simulation that nobody waits for.
                self.controls.stopped.wait(0.1)
            else:
                self._seen(record=record)
        return True

    # Words.

    def _event(self, name: str, words: str, **more: object) -> None:
        self.folder.event(self._events, name, words, **more)
        self._events += 1

    def _clocks(self) -> dict[str, Any]:
        camera = self.sight.camera_clock.joined()
        clocks: dict[str, Any] = {
            "camera": {"offset_s": camera.bed_s - camera.camera_s, "rate": camera.rate, "u_s": camera.u_s}
        }
        for name, instrument in (("actuator", self.sight.position), ("force_sensor", self.sight.force)):
            joined = None if instrument is None else instrument.clock.joined()
            if joined is not None:
                u_s = joined.u_at(joined.board_s)
                clocks[name] = {"offset_s": joined.host_s - joined.board_s, "rate": joined.rate, "u_s": u_s}
        return clocks

    def found(self) -> dict[str, Any]:
        """What run.json says of the run at its end."""
        return {
            "frames": self._rows,
            "frames_with_gap": self._with_gap,
            "frames_lost": self._lost,
            "clocks": self._clocks(),
            "reference_slots": self.slots,
        }


def run_number(row: SampleRow) -> int:
    """Number of a row's run: the label's first word."""
    return int(row.run.split()[0])


def _still(rows: list[GapRow]) -> bool:
    """Whether frames in a row show the same gap, or none."""
    gaps = [row.gap_mm for row in rows if row.gap_mm is not None]
    if len(gaps) < len(rows):
        return not gaps
    u = max(row.u_random_mm or 0.0 for row in rows)
    return max(gaps) - min(gaps) < STILL_SIGMAS * u


def _words(leg: Leg) -> str:
    match leg.act:
        case Go(to_mm, speed, _):
            return f"to {to_mm:g} mm at {speed:g} mm/s"
        case Stand(seconds, _):
            return f"stand for {seconds:g} s"
        case Swing(mean_mm, amplitude_mm, frequency_hz, _):
            return f"swing about {mean_mm:g} mm by {amplitude_mm:g} mm at {frequency_hz:g} Hz"
        case Close(speed, force_n):
            return f"close at {speed:g} mm/s below {force_n:g} N"
        case Slot(size_mm, _):
            return f"measure the slot of {size_mm:g} mm"
    return leg.act.__class__.__name__.lower()
