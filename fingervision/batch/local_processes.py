"""Workers on this machine: one process a core, one task at a time each."""

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from fingervision.batch.task import Outcome, Perform, Task, failure
from fingervision.batch.work import work

ATTEMPTS = 2
"""Times that a task is tried whose process dies under it: once may have been the system's choice of victim."""


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    link: Connection
    core: int
    number: int | None = None


def cores() -> tuple[int, ...]:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


def outcomes_of(
    tasks: Sequence[Task], perform: Perform, workers: int | None = None
) -> Generator[tuple[int, Outcome], None, None]:
    """Work on tasks in processes of their own, and give each outcome as it comes, with its task's number.

    Each process is bound to one core, so that decoders, OpenCV and linear algebra start one thread and not one a core:
    as many processes as cores then fill the machine and no more. A process that dies (of a fault in a decoder, for
    want of memory) costs its own task alone.

    Parameters
    ----------
    tasks : sequence of Task
        What shall be done.
    perform : callable
        Importable by its name.
    workers : int, optional
        Processes; one a core if not given.
    """
    places = cores()
    waiting = deque(range(len(tasks)))
    attempts = [0] * len(tasks)
    context = multiprocessing.get_context("spawn")
    crew: dict[object, _Worker] = {}

    def engage(core: int) -> None:
        link, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, perform, core), daemon=True)
        process.start()
        theirs.close()
        crew[link] = _Worker(process, link, core)
        hand_out(crew[link])

    def hand_out(worker: _Worker) -> None:
        worker.number = waiting.popleft() if waiting else None
        if worker.number is not None:
            attempts[worker.number] += 1
            with suppress(OSError):  # it died: that is seen when it is listened to
                worker.link.send(tasks[worker.number])

    try:
        for k in range(min(workers or len(places), len(tasks))):
            engage(places[k % len(places)])
        while any(worker.number is not None for worker in crew.values()):
            for link in wait([worker.link for worker in crew.values()]):
                worker = crew[link]
                number = worker.number
                try:
                    outcome: Outcome | None = worker.link.recv()
                except (EOFError, OSError):
                    outcome = None
                if outcome is not None:
                    hand_out(worker)
                else:
                    worker.process.join()
                    worker.link.close()
                    del crew[link]
                    if number is not None and attempts[number] < ATTEMPTS:
                        waiting.append(number)
                    elif number is not None:
                        outcome = failure(tasks[number], _died(tasks[number], worker.process.exitcode))
                    if waiting:
                        engage(worker.core)
                if number is not None and outcome is not None:
                    yield number, outcome
    finally:
        for worker in crew.values():
            if worker.number is not None:
                worker.process.kill()
            worker.link.close()
        for worker in crew.values():
            worker.process.join()


def _died(task: Task, exit_code: int | None) -> str:
    how = (
        f"signal {signal.Signals(-exit_code).name}" if exit_code is not None and exit_code < 0 else f"code {exit_code}"
    )
    return (
        f"{task.input} ended its process {ATTEMPTS} times ({how}): work on it alone to see why; SIGKILL mostly means "
        "that the memory was full."
    )


def _serve(link: Connection, perform: Perform, core: int) -> None:
    """Be a worker until the link is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the one who handed out decides
    if hasattr(os, "sched_setaffinity"):
        with suppress(OSError):
            os.sched_setaffinity(0, {core})
    with suppress(EOFError, OSError):
        while True:
            task: Task = link.recv()
            link.send(work(task, perform))
