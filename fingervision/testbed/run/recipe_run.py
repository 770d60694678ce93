"""Run a recipe on a test bed: plan it, check it, execute it, record it."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import Any

from fingervision.domain.errors import FingervisionError
from fingervision.domain.recipe import Recipe
from fingervision.measuring.rehearsal import rehearse
from fingervision.storage.drive_csv import SampleRow
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import SHIFT, TURN, Bed
from fingervision.testbed.manual import manual_control
from fingervision.testbed.recipe_kinds import Close, Go, Leg, Rezero, Shift, Slot, Stand, Swing, Turn
from fingervision.testbed.run import step_executor
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.plan import REST_FRAMES, Plan, check_moves, plan
from fingervision.testbed.run.run_folder import BedRunFolder
from fingervision.testbed.run.run_record import Counts, OnRow, RunRecord
from fingervision.testbed.run.safety_monitor import LARGEST_RATIO, MotionRatio, Say, Watch
from fingervision.testbed.run.synchronised_acquisition import Sight
from fingervision.testbed.simulation.injected_effects import NOTHING, Hidden

# Execute a plan segment by segment; on any failure the motor is stopped first.


# Number of frames that synchronise the clocks before anything moves; the last frames must show the fingers.
FIRST_FRAMES = 75
# A stage that takes less than this share of the expected time is faster than commanded, because ramps only make a
# motion longer. It is slower if the expected time is less than this share of what it takes, but for its settling time
# and RAMP_S for each motion.
LEAST_SHARE, RAMP_S = 0.5, 0.5

Progress = Callable[[float, float], None]


@dataclass(slots=True)
class Runner:
    """Executes a plan, starting where the recorded rows end.

    A simulated test bed, which can replay, executes the whole plan again; rows that are already in the folder are not
    rendered, measured or written a second time. On a real test bed the interrupted motion segment is repeated, as a new
    run.

    Parameters
    ----------
    plan : Plan
        The plan.
    watch : Watch
        Monitor through which the test bed is operated.
    on_progress : callable
        Called with the elapsed part of the expected duration and the whole expected duration (s).
    """

    plan: Plan
    watch: Watch
    on_progress: Progress
    _slots: list[dict[str, float]] = field(default_factory=list)
    _warned: set[str] = field(default_factory=set)

    def follow(self, last: SampleRow) -> None:
        """Continue after the last row of an earlier run; must be called first."""
        if self.watch.bed.replays:
            self.watch.record.follow_replayed(last)
        else:
            self.watch.record.follow(last, self.watch.bed.clock.now_s())

    def execute(self) -> Counts:
        """Execute the plan to its end.

        Raises
        ------
        StateError
            The user ended the run.
        DeviceError, LimitError, StateError
            A limit was reached, an instrument failed, or no fingers are in view; the motor is then at rest.
        """
        watch, actuator, replays = self.watch, self.watch.bed.actuator, self.watch.bed.replays
        try:
            # The motor of a simulation moves only while this thread lets time pass.
            with watch.controls.listening((lambda: None) if replays else actuator.stop):
                self._execute()
        except BaseException:
            try:
                actuator.stop()
            finally:
                # Rows that still wait for their position are left out: no reading says where the stage was when it
                # stopped. A simulation makes its last frames again.
                with suppress(FingervisionError):
                    watch.record.close(with_last=not replays)
            raise
        watch.record.close()
        return watch.record.counts

    def found(self) -> dict[str, Any]:
        """Results of the run for run.json."""
        counts = self.watch.record.counts
        return {
            "frames": counts.recorded,
            "frames_with_gap": counts.with_gap,
            "frames_lost": counts.lost,
            "clocks": self.watch.sight.clocks(),
            "reference_slots": self._slots,
        }

    def _execute(self) -> None:
        watch, record = self.watch, self.watch.record
        if not watch.bed.replays:
            # The position of a real stage is unknown at the start: home the stage first, but only with the fingers in
            # view.
            watch.find_fingers()
            watch.say(f"homed: {manual_control.home(watch.bed):z.3f} mm")
        for _ in range(FIRST_FRAMES - 1):
            watch.look()
        watch.find_fingers()
        first, approach = self._first_leg()
        total_s, done_s = (sum(leg.seconds for leg in legs) for legs in (self.plan, self.plan[:first]))
        foreseen_s = moved_s = ramps_s = 0.0
        recorded = record.counts.recorded
        record.event("began", f"The plan has {len(self.plan)} motion segments.", leg=first, frame=recorded)
        self._rest(first if approach is None else approach)
        if approach is not None:
            watch.leg = self.plan[approach]
            record.event("approach", f"Step {watch.leg.step} once more: {watch.leg.words}.", step=watch.leg.step)
            self._do(watch.leg, approach)
        for number, leg in enumerate(self.plan):
            if number < first:
                continue
            watch.leg = leg
            words = f"Step {leg.step}: {leg.words}."
            record.event("leg", words, leg=number, step=leg.step, frame=record.counts.recorded)
            began_s, from_mm = watch.now_s, watch.sight.position.newest
            if watch.ratio is not None:
                watch.ratio.begin()
            self._do(leg, number)
            if leg.is_continuous:
                watch.catch_up()
            if watch.ratio is not None and watch.ratio.interval[1] < 1.0 / LARGEST_RATIO:
                self._warn("small_motion", f"In step {leg.step}, {watch.ratio.words}, and whether the gripper is held.")
            if isinstance(leg.act, Go) and leg.act.frames is None:
                moved_s += watch.now_s - began_s
                ramps_s += watch.bed.actuator.limits.settling_s + RAMP_S
                foreseen_s += abs(leg.act.to_mm - from_mm) / leg.act.speed_mm_s
            done_s += leg.seconds
            self.on_progress(done_s, total_s)
        record.write(at_once=True)
        if moved_s < LEAST_SHARE * foreseen_s:
            self._warn_of_speed(
                "too_fast", moved_s, foreseen_s, "does not keep the commanded speed, so that frames are missing"
            )
        elif LEAST_SHARE * (moved_s - ramps_s) > foreseen_s:
            self._warn_of_speed("too_slow", moved_s, foreseen_s, "or its controller keeps to a lower speed")
        if lost := record.counts.lost:
            words = (
                f"{lost} frames are lost: unreadable, or missing by the camera's times and {watch.sight.rate_hz:g} Hz"
            )
            self._warn("frames_lost", f"{words}, because the computer was busy or the camera is slower than it states.")
        record.event(
            "clocks", "The instruments' clocks were compared with the test bed's clock.", **watch.sight.clocks()
        )
        record.event("ended", f"{record.counts.recorded} frames were recorded.")

    def _warn_of_speed(self, event: str, moved_s: float, foreseen_s: float, why: str) -> None:
        self._warn(
            event,
            f"The recorded motions took {moved_s:.3g} s, but should take {foreseen_s:.3g} s at the speeds of "
            f"the recipe: the stage {why}. Run its contract tests; `fingervision bed check` prints their command line.",
        )

    def _warn(self, event: str, words: str) -> None:
        """Say and record a warning; each once in a run."""
        if event not in self._warned:
            self._warned.add(event)
            self.watch.say(f"warning: {words[:1].lower()}{words[1:]}")
            self.watch.record.event(event, words)

    def _first_leg(self) -> tuple[int, int | None]:
        """Index of the first segment to execute, and of that which leads from the reference to its beginning, if any.

        With replay, or in a new run, the first segment is 0. Otherwise, it is the segment of the first frame without a
        row: rows are written some frames late, so that a killed program may have begun a later segment.
        """
        folder, legs = self.watch.record.folder, self.plan
        if self.watch.bed.replays or not folder.resumed:
            return 0, None
        self.watch.record.go_on((datetime.now(UTC) - folder.began_at).total_seconds())
        begun = [event for event in folder.events_done if "leg" in event and event["frame"] <= len(folder.rows)]
        first = int(begun[-1]["leg"]) if begun else 0
        # The stage stands at its reference, which is where it was re-zeroed. A sine ends where it begins.
        before = [number for number in range(first) if isinstance(legs[number].act, Go | Close | Rezero)]
        return first, before[-1] if before and not isinstance(legs[before[-1]].act, Rezero) else None

    def _do(self, leg: Leg, number: int) -> None:
        watch = self.watch
        match leg.act:
            case Go() | Stand() | Swing() | Close():
                step_executor.MOTIONS[type(leg.act)](watch, leg.act)
            case Slot():
                self._slots.append(step_executor.slot(watch, leg.act))
            case Rezero():
                step_executor.rezero(watch)
                self._new_run(number, turned=watch.record.turned, rezeroed=True)
            case Turn():
                watch.bed.operate(TURN)
                self._new_run(number, turned=not watch.record.turned)
            case Shift():
                watch.bed.operate(SHIFT)
                self._new_run(number, turned=watch.record.turned)

    def _new_run(self, leg: int, *, turned: bool, rezeroed: bool = False) -> None:
        self.watch.record.new_run(turned=turned, rezeroed=rezeroed)
        self._rest(leg + 1)

    def _rest(self, leg: int) -> None:
        """Record the pause at the start of a run, if the following segment is recorded continuously."""
        if leg < len(self.plan) and self.plan[leg].is_continuous:
            for _ in range(REST_FRAMES):
                self.watch.see(record=True)


@dataclass(frozen=True, slots=True)
class RunDone:
    r"""Result of a completed run.

    Parameters
    ----------
    folder : Path
        Folder with the run's files.
    counts : Counts
        Number of frames by status.
    resumed_after : int
        Number of frames recorded before an interruption; 0 for a new run.
    table : Path
        Measured table of the run, joined with the earlier run that it continues.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import fingervision as fv
    >>> folder = Path(tempfile.mkdtemp())
    >>> step = 'kind = "move"\nto_mm = 0.2\nspeed_mm_s = 0.4'
    >>> _ = (folder / "recipe.toml").write_text(f'schema = 1\nname = "open"\n[[step]]\n{step}\n')
    >>> with fv.bed("simulated", seed=1) as bed:
    ...     done = bed.run(folder / "recipe.toml", folder / "run")
    >>> done.counts.with_gap == done.counts.recorded, done.table.name
    (True, 'samples.csv')
    """

    folder: Path
    counts: Counts
    resumed_after: int
    table: Path


def run_recipe(
    recipe: Recipe[Section],
    bed: Bed,
    out: Path,
    hidden: Hidden = NOTHING,
    *,
    before: Sequence[SampleRow] = (),
    controls: Controls | None = None,
    on_progress: Progress = lambda done, total: None,
    say: Say = lambda words: None,
    on_plan: Callable[[Plan], None] = lambda planned: None,
    on_row: OnRow = lambda row, picture: None,
) -> RunDone:
    """Run a recipe; nothing moves before it is checked against the limits and both fingers are visible.

    Parameters
    ----------
    recipe : Recipe
        The recipe.
    bed : Bed
        The test bed; it is left open.
    out : Path
        Folder for the run; an interrupted run in it is continued.
    hidden : Hidden
        Effects injected into the test bed.
    before : sequence of SampleRow
        Rows of an earlier run on this test bed, whose numbering and clock this run continues.
    controls : Controls, optional
        Controls for pause and stop.
    on_progress, say, on_plan, on_row : callable
        Called with: seconds done and expected; sentences; the plan before it is executed; every row once its position
        is known and before its gap is, with its picture.

    Raises
    ------
    FingervisionError
        The run failed; the motor is at rest, and the folder remains valid.
    """
    if not bed.replays:
        # Compile the measuring functions now: at the first frame, compilation could block all threads for longer than
        # the board runs its motor without a message.
        rehearse()
    sight = Sight(bed)
    sight.position.read()
    # A real stage is homed before the first motion segment.
    at_mm = sight.position.newest if bed.replays else 0.0
    planned = plan(recipe, bed.limits, bed.model, at_mm, sight.rate_hz, sight.width_mm)
    check_moves(planned, bed.actuator, bed.limits, at_mm)
    on_plan(planned)
    folder = BedRunFolder(out, recipe, bed, sight, hidden, before)
    try:
        size_px = (sight.camera.description.width_px, sight.camera.description.height_px)
        left = max(sum(leg.seconds for leg in planned) * sight.rate_hz - len(folder.rows), 0.0)
        folder.needs_room(left, size_px)
        # A camera that states no rate shows no lost frame, and a screw that is turned by hand waits for the hand.
        tells = sight.camera.description.rate_hz is not None and isfinite(bed.actuator.limits.settling_s)
        continuous = {leg.step for leg in planned if leg.is_continuous and tells}
        record = RunRecord(
            folder, lambda bed_s, at_once: sight.position.at(bed_s, at_once=at_once), continuous, sight.rate_hz, on_row
        )
        ratio = None if bed.replays or bed.model is None else MotionRatio(bed.model, bed.limits)
        watch = Watch(bed, sight, record, controls or Controls(), recipe.below_force_n, say, ratio=ratio)
        runner = Runner(planned, watch, on_progress)
        if before:
            runner.follow(before[-1])
        counts = runner.execute()
        folder.finish(runner.found())
    except BaseException as error:
        folder.break_off(str(error) or type(error).__name__)
        raise
    return RunDone(out, counts, len(folder.rows), out / ("joined.csv" if before else "samples.csv"))
