"""Who works for a benchmark: processes of this machine, or an existing Dask cluster."""

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from fingervision.batch.cluster import connected


@contextmanager
def workers(scheduler: str | None, jobs: int) -> Iterator[Executor]:
    """Give an executor of so many processes, or that of a cluster whose workers run the same versions."""
    if scheduler is None:
        with ProcessPoolExecutor(jobs) as pool:
            yield pool
        return
    with connected(scheduler) as client:
        yield client.get_executor(pure=False)
