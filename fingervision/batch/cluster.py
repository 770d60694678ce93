"""Workers of an existing Dask cluster; all files must be on a path that every computer can access."""

import hashlib
import logging
import os
import platform
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from pathlib import Path
from typing import Any

import calib
import fingervision
from fingervision.batch.task import Outcome, Perform, Task, failure
from fingervision.batch.work import work
from fingervision.domain.errors import MissingLibraryError, ProcessError, UsageError

# Versions of a worker's software, and a hash of the source code.

LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "av", "matplotlib")


@cache
def versions() -> dict[str, str]:
    """Versions of the installed software, by name."""
    found = {"Python": ".".join(platform.python_version_tuple()[:2]), "fingervision": fingervision.__version__}
    for library in LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            found[library] = "not installed"
    return {**found, "source of fingervision": _source()}


def difference(here: dict[str, str], there: dict[str, str]) -> str:
    """Describe the differences between two sets of versions; empty if they are equal."""
    return ", ".join(
        f"{name} {there.get(name, 'unknown')} instead of {here[name]}" for name in here if there.get(name) != here[name]
    )


def _source() -> str:
    """Hash of all Python and C sources of both packages, because two copies of the same version may still differ."""
    found = hashlib.sha256()
    for package in (fingervision, calib):
        top = Path(str(package.__file__)).parent
        for file in sorted(path for kind in ("*.py", "*.c", "*.h") for path in top.rglob(kind)):
            found.update(f"{file.relative_to(top).as_posix()}\0".encode())
            found.update(file.read_bytes())
    return found.hexdigest()[:12]


PATIENCE_S = 10
"""Longest wait for a response of the scheduler, and for a worker."""
WINDOW = 4
"""Number of queued tasks per worker thread, so that the thread is never idle, while the scheduler holds only few of
many thousand tasks."""


@contextmanager
def connected(scheduler: str, patience_s: float = PATIENCE_S) -> Iterator[Any]:
    """Connect to a cluster and check that its workers have the same software versions as this computer.

    Parameters
    ----------
    scheduler : str
        Address of the scheduler, `tcp://HOST:PORT`.
    patience_s : float
        Longest time to wait for a response of the scheduler.

    Yields
    ------
    distributed.Client
        Connected client; its `get_executor()` returns a `concurrent.futures.Executor`.

    Raises
    ------
    UsageError
        The text is not a network address.
    MissingLibraryError, ProcessError
        Dask is not installed, the scheduler does not answer, or there are no workers of the same version.
    """
    try:
        from distributed import Client
    except ImportError:
        raise MissingLibraryError("Dask", "cluster", "--scheduler") from None
    if not scheduler.startswith(("tcp://", "tls://")) or not scheduler.rpartition(":")[2].isdigit():
        raise UsageError(f"--scheduler must be an address such as tcp://host:8786, but is {scheduler}.")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # this program reports Dask's errors itself
    try:
        client = Client(scheduler, timeout=patience_s, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        raise ProcessError(
            f"The scheduler must answer within {patience_s:g} s, but {scheduler} does not: start `dask "
            "scheduler` there, or check address and firewall."
        ) from error
    try:
        _check_workers(client, scheduler, patience_s)
        yield client
    finally:
        client.close(timeout=patience_s)


def _check_workers(client: Any, scheduler: str, patience_s: float) -> None:
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except TimeoutError:
        raise ProcessError(
            f"The cluster must have workers, but {scheduler} has none after {patience_s:g} s: "
            f"start `dask worker {scheduler} --nthreads 1` on its machines."
        ) from None
    here = versions()
    found = client.run(versions, on_error="return")
    for address, there in found.items():
        words = difference(here, there) if isinstance(there, dict) else f"no fingervision ({there})"
        if words:
            raise ProcessError(
                f"Every worker must have the versions that are installed here, but {address} has {words}: install "
                "the same there and restart it."
            )


def outcomes_of(client: Any, tasks: Sequence[Task], perform: Perform) -> Generator[tuple[int, Outcome], None, None]:
    """Process tasks on a cluster, and yield each outcome as it arrives, with the index of its task.

    The scheduler assigns the task of a dead worker to another worker; a task may then run twice, which is harmless.

    Raises
    ------
    ProcessError
        The connection to the scheduler is lost.
    """
    from distributed import KilledWorker, as_completed

    here = versions()
    threads = sum(worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values())
    numbers = iter(range(len(tasks)))
    waiting: dict[Any, int] = {}

    def submitted(number: int) -> Any:
        future = client.submit(_work_there, _absolute(tasks[number]), perform, here, pure=False)
        waiting[future] = number
        return future

    first = [submitted(number) for number in islice(numbers, WINDOW * max(1, threads))]
    running = as_completed(first, loop=client.loop)
    try:
        for future in running:
            number = waiting.pop(future)
            try:
                outcome = future.result()
                outcome = replace(outcome, input=tasks[number].input)
            except KilledWorker as error:
                words = (
                    f"{tasks[number].input} ended {error.allowed_failures + 1} workers: process this input alone to "
                    f"see the cause."
                )
                outcome = failure(tasks[number], words)
            except Exception as error:
                if client.status != "running" or future.status in ("cancelled", "lost"):
                    raise ProcessError(
                        "The connection to the scheduler was lost; finished results are kept: start the "
                        "scheduler again, then repeat this command."
                    ) from error
                outcome = failure(
                    tasks[number], f"{tasks[number].input} could not be processed by its worker ({error})."
                )
            following = next(numbers, None)
            if following is not None:
                running.add(submitted(following))
            yield number, outcome
    finally:
        client.cancel(list(waiting))


def _absolute(task: Task) -> Task:
    """Make the file names in a task absolute, because a worker may have another working directory."""
    return replace(task, input=os.path.abspath(task.input), folder=Path(os.path.abspath(task.folder)))  # noqa: PTH100


def _work_there(task: Task, perform: Perform, wanted: dict[str, str]) -> Outcome:
    """Process a task on a worker; if the worker joined the cluster late, first check its software versions."""
    words = difference(wanted, versions())
    if words:
        return failure(task, f"A worker joined that has {words}: install the same there and restart it.")
    return work(task, perform)
