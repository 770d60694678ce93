"""Worker processes on this computer, one per core, each with one task at a time."""

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Self

from fingervision.batch.task import Ended, Outcome, Perform, Task, failure
from fingervision.batch.work import work
from fingervision.domain.errors import ProcessError

ATTEMPTS = 2
"""Number of attempts for a task whose process dies; the system may have ended the first process for lack of memory."""


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    link: Connection
    core: int
    number: int | None = None
    is_asked: bool = False


def cores() -> tuple[int, ...]:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


class LocalCrew:
    """Worker processes on this computer, started together, each with one task at a time.

    Each process is bound to one core, so that decoders, OpenCV and linear algebra start one thread each instead of one
    per core; with as many processes as cores, every core is then used exactly once. If a process dies (because of a
    fault in a decoder, or lack of memory), only its task is lost.

    Parameters
    ----------
    perform : callable
        Function that performs a command; it must be importable by name.
    size : int
        Number of processes.
    """

    def __init__(self, perform: Perform, size: int) -> None:
        self._perform, self._size = perform, size
        self._context = multiprocessing.get_context("spawn")
        self._workers: dict[object, _Worker] = {}
        self._fill_up()

    def __enter__(self) -> Self:
        """Start the worker processes; all of them are ended when the `with` block is left."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes."""
        self._let_go()
        for worker in self._workers.values():
            worker.process.join()

    def answer(self, command: str, arguments: tuple[str, ...]) -> Ended:
        """Let one worker execute a command, and return the worker's result.

        The command is sent to every process, so that all of them already import the modules that the tasks need; the
        first result is returned.

        Raises
        ------
        ProcessError
            All worker processes ended during the command.
        """
        for worker in self._workers.values():
            worker.is_asked = True
            with suppress(OSError):  # the process has ended, which is noticed when its connection is read
                worker.link.send((command, arguments))
        while self._workers:
            for link in wait([worker.link for worker in self._workers.values()]):
                worker = self._workers[link]
                try:
                    ended: Ended = worker.link.recv()
                except (EOFError, OSError):
                    self._bury(worker)
                    continue
                worker.is_asked = False
                return ended
        raise ProcessError(
            f"Every process ended before its first task: try `fingervision {command}` on one input to see the cause."
        )

    def outcomes_of(self, tasks: Sequence[Task]) -> Generator[tuple[int, Outcome], None, None]:
        """Process tasks, and yield each outcome as it arrives, with the index of its task; then end the workers.

        Parameters
        ----------
        tasks : sequence of Task
            Tasks to process.
        """
        waiting = deque(range(len(tasks)))
        attempts = [0] * len(tasks)

        def hand_out(worker: _Worker) -> None:
            worker.number = waiting.popleft() if waiting else None
            if worker.number is not None:
                attempts[worker.number] += 1
                with suppress(OSError):
                    worker.link.send(tasks[worker.number])

        try:
            self._fill_up()
            for worker in self._workers.values():
                if not worker.is_asked:
                    hand_out(worker)
            while waiting or any(worker.number is not None for worker in self._workers.values()):
                for link in wait([worker.link for worker in self._workers.values()]):
                    worker = self._workers[link]
                    number = worker.number
                    try:
                        answer: Outcome | Ended | None = worker.link.recv()
                    except (EOFError, OSError):
                        answer = None
                    if answer is not None:
                        worker.is_asked = False
                        hand_out(worker)
                    else:
                        self._bury(worker)
                        if number is not None and attempts[number] < ATTEMPTS:
                            waiting.append(number)
                        elif number is not None:
                            answer = failure(tasks[number], _died(tasks[number], worker.process.exitcode))
                        if waiting:
                            hand_out(self._engage(worker.core))
                    if number is not None and isinstance(answer, Outcome):
                        yield number, answer
        finally:
            self._let_go()

    def _fill_up(self) -> None:
        places = cores()
        for k in range(len(self._workers), self._size):
            self._engage(places[k % len(places)])

    def _engage(self, core: int) -> _Worker:
        link, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(theirs, self._perform, core), daemon=True)
        with _no_interrupt():
            process.start()
        theirs.close()
        self._workers[link] = _Worker(process, link, core)
        return self._workers[link]

    def _bury(self, worker: _Worker) -> None:
        worker.process.join()
        worker.link.close()
        del self._workers[worker.link]

    def _let_go(self) -> None:
        """End the workers that still have a task in progress; idle workers end by themselves."""
        busy = [worker for worker in self._workers.values() if worker.number is not None or worker.is_asked]
        for worker in busy:
            worker.process.kill()
        for worker in self._workers.values():
            worker.link.close()
        for worker in busy:  # busy workers must not write any more
            worker.process.join()


def _died(task: Task, exit_code: int | None) -> str:
    how = (
        f"signal {signal.Signals(-exit_code).name}" if exit_code is not None and exit_code < 0 else f"code {exit_code}"
    )
    return (
        f"{task.input} ended its process {ATTEMPTS} times ({how}): process this input alone to see the cause; SIGKILL "
        f"usually means that the memory was full."
    )


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Block Ctrl-C, so that a process started in the `with` block never receives it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(link: Connection, perform: Perform, core: int) -> None:
    """Main loop of a worker, until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the main process decides
    if hasattr(os, "sched_setaffinity"):
        with suppress(OSError):
            os.sched_setaffinity(0, {core})
    import cv2  # takes 0.1 s, which the main process need not spend

    cv2.setNumThreads(1)  # also if a process cannot be bound to a core
    with suppress(EOFError, OSError):
        while True:
            asked: Task | tuple[str, tuple[str, ...]] = link.recv()
            link.send(work(asked, perform) if isinstance(asked, Task) else perform(*asked))
