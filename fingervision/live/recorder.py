"""Recording in a separate thread, so that a slow disk does not delay the measurement."""

import shutil
from pathlib import Path
from queue import Empty, Full, Queue
from time import monotonic, process_time, thread_time

from fingervision.domain.errors import OutputError
from fingervision.live.run_folder import RecordedFrame, RunFolder
from fingervision.live.supervisor import Supervisor, told

# Processor time of a thread and of the process: used, or waited for while other threads and programs had it.


# Of each thread: nanoseconds on a processor, nanoseconds ready to run without one (Linux, Documentation/scheduler/
# sched-stats.rst).
TASKS, SCHEDULED = Path("/proc/self/task"), Path("/proc/thread-self/schedstat")


def of_this_thread_s() -> float:
    """Processor time (s) that the calling thread has used or waited for; the waits are known on Linux only."""
    return thread_time() + _waited_s(SCHEDULED)


def of_process_s() -> float:
    """Processor time (s) that all threads of this process have used or waited for."""
    return process_time() + sum(map(_waited_s, TASKS.glob("*/schedstat")))


def _waited_s(file: Path) -> float:
    try:
        return 1e-9 * int(file.read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0


# Time for which the disk space suffices for a recording at its present data rate (minutes).


# Shorter or smaller recordings give no data rate: the first frames differ in size, and the file is buffered.
LEAST_S, LEAST_BYTES = 2.0, 1_000_000


def minutes_left(folder: Path, seconds: float) -> float | None:
    """Minutes until the disk of a recording is full; None until the data rate is known.

    Parameters
    ----------
    folder : Path
        Folder of the recording.
    seconds : float
        Duration of the recording so far.
    """
    try:
        written = sum(file.stat().st_size for file in folder.iterdir())
        free = shutil.disk_usage(folder).free
    except OSError:
        return None
    if seconds < LEAST_S or written < LEAST_BYTES:
        return None
    return free / (written / seconds) / 60.0


# Largest number of frames that wait for the disk: ten seconds at 25 frames per second. The recording ends if more
# frames would have to wait.
FRAMES_WAITING = 250
# With more waiting frames than this number, the preview is slowed down.
FRAMES_UNTIL_HURRY = 12
# Longest time without a frame that is written or measured, after the recording is stopped; and until the first is
# measured, because the camera is learnt before, which takes a minute beside programs that take the processor.
PATIENCE_S, LEARNING_S, LOOK_EVERY_S = 30.0, 300.0, 0.1
DISK_EVERY_S = 1.0
# A thread that writes is limited by the processor if it used or awaited one during at least this share of the time. If
# not, its waits are those for the disk, unless all threads together needed this share of one processor, which only one
# thread at a time may have while it executes Python.
OF_ONE_PROCESSOR = 0.5, 0.9
RECORDING = "Recording"


class Recorder:
    """Writes frames to a run folder in a separate thread.

    Parameters
    ----------
    run : RunFolder
        Folder of the run, opened for writing.
    supervisor : Supervisor
        Supervisor of the live view.
    """

    def __init__(self, run: RunFolder, supervisor: Supervisor) -> None:
        self.run, self._supervisor = run, supervisor
        self.began_s = monotonic()
        self.minutes_left: float | None = None
        self._looked_s = self.began_s
        self.failure = ""
        self._waiting: Queue[RecordedFrame | tuple[str, str] | None] = Queue(FRAMES_WAITING)
        self._why = "Recording was stopped."
        self._worked_s = 0.0
        self._since: tuple[float, float, float] | None = None
        self._began = (self.began_s, 0.0, of_process_s())
        self._thread = supervisor.start(RECORDING, self._write, self.fail)

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
            self.fail(self._too_slow())

    def fail(self, why: str) -> None:
        """End the recording with an alarm."""
        self.failure = why
        self._supervisor.alarm(RECORDING, f"Recording has ended: {why}")

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
                self.fail(self._too_slow())
        self.join()
        if self.failure:
            raise OutputError(self.failure)

    def join(self) -> None:
        """Wait until everything is written that was recorded before the end, and measured, as long as it goes on."""
        done, since_s = (-1, -1), monotonic()
        while self._thread.is_alive():
            self._thread.join(LOOK_EVERY_S)
            if done != (now := (self.run.frames, self.run.measured)):
                done, since_s = now, monotonic()
            if monotonic() - since_s > (PATIENCE_S if self.run.measured else LEARNING_S):
                self.fail(self._too_slow())
                return

    def _too_slow(self) -> str:
        """State whether the disk or the processor was the bottleneck since frames have had to wait."""
        since_s, worked_s, used_s = self._since or self._began
        waited_s = max(monotonic() - since_s, 1e-3)
        writes, needs = (self._worked_s - worked_s) / waited_s, (of_process_s() - used_s) / waited_s
        processor = "close other programs, or choose smaller pictures or a lower frame rate"
        disk = "record to a folder on another disk"
        what, advice = f"The disk of {self.run.path}", disk
        if writes >= OF_ONE_PROCESSOR[0]:
            what, advice = "The processor", processor
        elif needs >= OF_ONE_PROCESSOR[1]:
            what, advice = f"The processor, or the disk of {self.run.path},", f"{processor}, or {disk}"
        return (
            f"{what} is too slow for this camera, so that recording ended; the frames recorded before are valid: "
            f"{advice}."
        )

    @property
    def _gone(self) -> str:
        return (
            f"The folder {self.run.path} is gone (its disk was removed, or it was deleted), so recording ended: put "
            "the disk back, or record to another folder."
        )

    def _note_the_hurry(self) -> None:
        """Note what this thread and the process have used since frames wait; without a hurry nothing is read."""
        if not self.in_a_hurry:
            self._since = None
            return
        self._worked_s = of_this_thread_s()
        self._since = self._since or (monotonic(), self._worked_s, of_process_s())

    def _look_at_the_disk(self) -> None:
        """Check whether the folder was deleted, which writing does not report, and how long the disk space suffices."""
        if monotonic() - self._looked_s < DISK_EVERY_S:
            return
        self._looked_s = monotonic()
        if not self.run.is_there:
            raise OutputError(self._gone)
        self.minutes_left = minutes_left(self.run.path, monotonic() - self.began_s)

    def _write(self) -> None:
        try:
            self._write_all()
        except Exception as error:  # the run is closed with the reason, whatever ended it
            self.fail(told(error) if self.run.is_there else self._gone)
        try:
            self.run.close(self.failure or self._why)
        except Exception as error:  # a first failure is the cause
            self.fail(self.failure or told(error))

    def _write_all(self) -> None:
        while True:
            try:
                what = self._waiting.get(timeout=0.5)
            except Empty:
                if self.failure:
                    return
                continue
            if what is None:
                return
            if isinstance(what, RecordedFrame):
                self.run.add(what)
            else:
                self.run.event(*what)
            self._note_the_hurry()
            self._look_at_the_disk()
