"""Recording in a separate thread, so that a slow disk does not delay the measurement."""

from queue import Empty, Full, Queue
from threading import Thread
from time import monotonic

from fingervision.domain.errors import FingervisionError, OutputError
from fingervision.live.free_space import minutes_left
from fingervision.live.promptness import be_prompt
from fingervision.live.run_folder import RecordedFrame, RunFolder

# Largest number of frames that wait for the disk: ten seconds at 25 frames per second. The recording ends if more
# frames would have to wait.
FRAMES_WAITING = 250
# With more waiting frames than this number, the preview is slowed down.
FRAMES_UNTIL_HURRY = 12
# Longest time that the disk may take for the waiting frames after the recording is stopped.
PATIENCE_S = 30.0
DISK_EVERY_S = 1.0


class Recorder:
    """Writes frames to a run folder in a separate thread.

    Parameters
    ----------
    run : RunFolder
        Folder of the run, opened for writing.
    """

    def __init__(self, run: RunFolder) -> None:
        self.run = run
        self.began_s = monotonic()
        self.minutes_left: float | None = None
        self._looked_s = self.began_s
        self.failure = ""
        self._waiting: Queue[RecordedFrame | tuple[str, str] | None] = Queue(FRAMES_WAITING)
        self._why = "Recording was stopped."
        self._thread = Thread(target=self._write, name="recorder", daemon=True)
        self._thread.start()

    @property
    def in_a_hurry(self) -> bool:
        """Whether writing to the disk is slower than the arrival of frames."""
        return self._waiting.qsize() > FRAMES_UNTIL_HURRY

    def add(self, what: RecordedFrame | tuple[str, str]) -> None:
        """Queue a frame, or an event (its name and words)."""
        if self.failure:
            return
        try:
            self._waiting.put_nowait(what)
        except Full:
            self.failure = self._too_slow()

    def stop(self) -> None:
        """End the recording and wait for the disk.

        Raises
        ------
        OutputError
            The run could not be written to its end.
        """
        if not self.failure:
            try:
                self._waiting.put(None, timeout=PATIENCE_S)
            except Full:
                self.failure = self._too_slow()
        self._thread.join(PATIENCE_S)
        if self.failure:
            raise OutputError(self.failure)

    def _too_slow(self) -> str:
        return (
            f"The disk of {self.run.path} is too slow for this camera, so that recording ended; the frames recorded "
            f"before are valid: name a folder on another disk with --out."
        )

    def _look_at_the_disk(self) -> None:
        """Check whether the folder was deleted, which writing does not report, and how long the disk space suffices."""
        if monotonic() - self._looked_s < DISK_EVERY_S:
            return
        self._looked_s = monotonic()
        if not self.run.is_there:
            raise OutputError(
                f"The folder {self.run.path} is gone (its disk was removed, or it was deleted), so recording ended: "
                "put the disk back, or name another folder with --out."
            )
        self.minutes_left = minutes_left(self.run.path, monotonic() - self.began_s)

    def _write(self) -> None:
        be_prompt()
        try:
            while True:
                try:
                    what = self._waiting.get(timeout=0.5)
                except Empty:
                    if self.failure:
                        break
                    continue
                if what is None:
                    break
                if isinstance(what, RecordedFrame):
                    self.run.add(what)
                else:
                    self.run.event(*what)
                self._look_at_the_disk()
        except FingervisionError as error:
            self.failure = str(error)
        try:
            self.run.close(self.failure or self._why)
        except FingervisionError as error:
            self.failure = self.failure or str(error)
