"""Thread of the test bed, which acquires frame after frame and executes requested tasks between two frames."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event, Thread
from time import monotonic
from typing import Any

import av

from fingervision.domain.errors import FingervisionError, StateError
from fingervision.domain.frame import Frame
from fingervision.domain.recipe import Recipe
from fingervision.frames.source import Description, Driven, Received
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.session import Session
from fingervision.live.supervisor import Supervisor
from fingervision.storage.drive_csv import SampleRow
from fingervision.storage.out_folder import make_out_folder
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.manual.manual_control import home, jog, move
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.run.run_folder import SIMULATION, write_expected
from fingervision.testbed.run.synchronised_acquisition import Look, Sight
from fingervision.testbed.simulation.injected_effects import NOTHING, Hidden, hidden_from

# Largest number of frames that wait for the live view; further frames are dropped, because the bed does not wait.
FRAMES_WAITING = 50
# Longest wait (s) for the thread of the test bed to end.
ENDS_WITHIN_S = 5.0

Say = Callable[[str, str], None]


@dataclass(frozen=True, slots=True)
class Task:
    """An action of the test bed: its name in the browser page, and the function that executes it."""

    name: str
    act: Callable[[], str]


class Bench:
    """A test bed as a live source; a single thread uses camera and motor.

    Parameters
    ----------
    bed : Bed
        An opened test bed with a camera and a scale.
    hidden : Hidden
        Effects hidden in the simulated parts of the test bed; a digest of them is stored with every run.

    Raises
    ------
    FingervisionError
        The test bed has no camera, or no scale for the camera's frames.
    """

    has_own_clock = True
    template: av.VideoStream | None = None

    def __init__(self, bed: Bed, hidden: Hidden = NOTHING) -> None:
        self.bed, self.hidden = bed, hidden
        self._sight = _eyes(bed)
        self.description: Description = self._sight.camera.description
        self.say: Say = lambda name, words: None
        self.supervisor = Supervisor(lambda name, words: self.say(name, words))
        """Supervisor of the bed's thread; a live view replaces it by its own."""
        self.doing, self.position_mm = "", 0.0
        self.force_n: float | None = None
        self.progress: tuple[float, float] | None = None
        self._frames: Queue[Received | str] = Queue(FRAMES_WAITING)
        self._waiting: deque[tuple[Look, Frame]] = deque()
        self._asked: Queue[Task] = Queue(1)
        self._controls: Controls | None = None
        self._run, self._index = 1, 0
        self._ending, self._stop_asked = Event(), False
        self._thread: Thread | None = None

    # ---- a live source
    def received(self) -> Iterator[Received]:
        """Yield frames with the stage's position at their exposure, until the test bed is closed or fails."""
        self._thread = self.supervisor.start("The test bed", self._work, self._failed)
        while True:
            try:
                following = self._frames.get(timeout=0.1)
            except Empty:
                if self._ending.is_set():
                    return
                continue
            if isinstance(following, str):
                raise StateError(following)
            yield following

    def close(self) -> None:
        """Stop the motor, and then close the test bed."""
        if self._ending.is_set():
            return
        self.stop()
        self._ending.set()
        if self._thread is not None:
            self._thread.join(ENDS_WITHIN_S)
        self.bed.close()

    def join(self, session: Session, *, allow_motion: bool) -> Path | None:
        """Become the test bed of a session.

        Parameters
        ----------
        session : Session
            The live measurement whose source this is.
        allow_motion : bool
            Whether users of the browser page may move the stage.

        Returns
        -------
        Path or None
            Prediction for the gripper of the bed without the hidden effects, in the form of the file beside a run's
            table; None if its gripper has no model.
        """
        session.features |= {"bed": self, "allow_motion": allow_motion}
        self.say, self.supervisor = session.say, session.supervisor
        if self.bed.model is None:
            return None
        make_out_folder(session.out)
        write_expected(session.out / SIMULATION, self.bed.model, self.bed.limits)
        return session.out / SIMULATION

    # ---- requests, from any thread
    def stop(self) -> None:
        """Stop the motor at once, and discard all requested tasks."""
        self._stop_asked = True
        if self._controls is not None:
            self._controls.stop()
        self.bed.actuator.stop()

    def home(self) -> None:
        """Move the stage to its reference position."""
        self._ask(Task("homing", lambda: f"At the reference: {home(self.bed, self._looking):z.4f} mm."))

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Move the stage to a position within the limits."""

        def act() -> str:
            return f"At {move(self.bed, to_mm, speed_mm_s, self._looking):z.4f} mm."

        self._ask(Task(f"moving to {to_mm:g} mm", act))

    def jog(self, speed_mm_s: float, for_s: float) -> None:
        """Move the stage at a signed speed for a given time, at most to the limit."""
        self._ask(Task("jogging", lambda: f"At {jog(self.bed, speed_mm_s, for_s, looking=self._looking):z.4f} mm."))

    def run(self, recipe: Recipe[Section], out: Path) -> None:
        """Run a recipe and write its results to a folder."""
        self._ask(Task(f"running {recipe.name}", lambda: self._recipe(recipe, out)))

    def _ask(self, task: Task) -> None:
        if self.doing:
            raise StateError(f"The test bed is {self.doing}: wait until it has finished, or stop it first.")
        if self._ending.is_set():
            raise StateError("The test bed is closed: start the live view again.")
        self._stop_asked = False
        try:
            self._asked.put_nowait(task)
        except Full:
            raise StateError(
                "The test bed is still carrying out an earlier request: wait until it has finished, or stop it first."
            ) from None

    # ---- the thread
    def _work(self) -> None:
        while not self._ending.is_set():
            try:
                task = self._asked.get_nowait()
            except Empty:
                self._look()
                continue
            self._do(task)

    def _failed(self, why: str) -> None:
        """Stop the motor, and end the source."""
        try:
            self.bed.actuator.stop()
        finally:
            self._hand_over(why)

    def _do(self, task: Task) -> None:
        if self._stop_asked:
            self.say("bed", "The motion was stopped before it began.")
            return
        self.doing = task.name
        try:
            self.say("bed", task.act())
        except FingervisionError as error:
            self.say("bed_refused", str(error))
        finally:
            self.doing, self.progress = "", None

    def _looking(self) -> tuple[float, float | None]:
        self._look()
        return self.position_mm, self.force_n

    def _look(self) -> None:
        """Acquire one frame, and keep it until the stage's position at its exposure can be interpolated."""
        look = self._sight.look()
        self.position_mm, self.force_n = look.encoder_mm, look.force_now_n
        item = look.shot.item()
        if isinstance(item, Frame):
            self._waiting.append((look, item))
        while self._waiting:
            first, frame = self._waiting[0]
            input_mm = self._sight.position.at(first.exposed_s)
            if input_mm is None:
                return
            self._waiting.popleft()
            self._hand_over(Received(frame, monotonic(), (), Driven(input_mm, first.force_n, str(self._run))))

    def _recipe(self, recipe: Recipe[Section], out: Path) -> str:
        self._waiting.clear()
        self._run += 1
        first_run = self._run
        self._controls = Controls()

        def on_row(row: SampleRow, picture: Frame) -> None:
            number, *rest = row.run.split()
            self._run = first_run + int(number) - 1
            self.position_mm = row.encoder_mm or 0.0
            self.force_n = row.force_n
            if row.input_mm is not None:
                driven = Driven(row.input_mm, row.force_n, " ".join([str(self._run), *rest]))
                frame = replace(picture, time_s=row.camera_s)
                self._hand_over(Received(frame, monotonic(), (), driven))

        try:
            done = run_recipe(
                recipe,
                self.bed,
                out,
                self.hidden,
                controls=self._controls,
                on_progress=self._note_progress,
                say=lambda words: self.say("bed", words),
                on_row=on_row,
            )
        finally:
            self._controls = None
            self._run += 1
            # The run has consumed encoder readings, so that the interpolation from before the run cannot be continued.
            self._sight = _eyes(self.bed)
        return f"{done.counts.recorded} frames, {done.counts.with_gap} with a gap: {done.folder}."

    def _note_progress(self, now_s: float, total_s: float) -> None:
        self.progress = (now_s, total_s)

    def _hand_over(self, what: Received | str) -> None:
        if isinstance(what, Received):
            what = replace(what, item=replace(what.item, index=self._index))
            self._index += 1
        try:
            self._frames.put(what, timeout=0.0 if isinstance(what, Received) else 1.0)
        except Full:
            return

    @property
    def limits(self) -> dict[str, Any]:
        """Soft limits of the test bed, for the browser page."""
        limits = self.bed.limits
        return {
            "lower_mm": limits.lower_mm,
            "upper_mm": limits.upper_mm,
            "speed_mm_s": limits.speed_mm_s,
            "force_n": limits.force_n,
            "gap_mm": limits.gap_mm,
        }


def _eyes(bed: Bed) -> Sight:
    sight = Sight(bed)
    sight.position.read()
    return sight


# Open a test bed by name, with its camera as the live source.


def opened_bed(name: str, hide: tuple[str, ...], choices: Choices) -> tuple[Capture, Choices]:
    """Open a test bed; a simulated test bed runs in real time.

    Parameters
    ----------
    name : str
        The word "simulated", or the path of a configuration file.
    hide : tuple of str
        Effects injected into the simulated parts of the test bed.
    choices : Choices
        Settings chosen by the user; without a given scale and height, those of the test bed apply.

    Raises
    ------
    DataError, InputFileError, UsageError
        The test bed cannot be opened, or has neither camera nor scale.
    """
    hidden = hidden_from(hide)
    bed = open_bed(name, hidden, pace=1.0)
    try:
        bench = Bench(bed, hidden)
    except FingervisionError:
        bed.close()
        raise
    chosen = replace(choices, scale=bed.scale, scale_file=None, below_tip_mm=bed.below_tip_mm)
    return Capture(bench, again=None), chosen
