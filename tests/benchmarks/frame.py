"""What benchmarks share: options, draws in turn within a time, processes, time that work takes, and tables."""

import argparse
import resource
import sys
import time
from argparse import Namespace
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from statistics import median
from typing import Any, TypeVar

T = TypeVar("T")
R = TypeVar("R")
UNENDING = float("inf")


def options_of(about: str | None, given: Sequence[str] | None = None, /, **defaults: Any) -> Namespace:
    """Read options: each has the type of its default, False is a switch, and a dict has argparse's own settings.

    A tuple is the default of words that are given without an option's name.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        own = {"action": "store_true"} if default is False else {"type": type(default), "default": default}
        if isinstance(default, tuple):
            parser.add_argument(name, nargs="*", default=list(default))
        else:
            parser.add_argument(f"--{name.replace('_', '-')}", **(default if isinstance(default, dict) else own))
    return parser.parse_args(given)


def benchmark(**defaults: Any) -> Callable[[Callable[[Namespace], T]], Callable[..., T | None]]:
    """Make a module's `main`, which stands at its end, a program with options; it runs if the module is run."""

    def as_program(main: Callable[[Namespace], T]) -> Callable[..., T | None]:
        def program(arguments: Sequence[str] | None = None) -> T | None:
            return main(options_of(sys.modules[main.__module__].__doc__, arguments, **defaults))

        if main.__module__ == "__main__":
            program()
        return program

    return as_program


def listed(there: Collection[str]) -> dict[str, Any]:
    """Settings of an option for some of several words, with commas between them; all by default."""

    def words(text: str) -> list[str]:
        if unknown := [word for word in text.split(",") if word not in there]:
            raise argparse.ArgumentTypeError(f"must be of {', '.join(there)}, but has {', '.join(unknown)}.")
        return text.split(",")

    return {"type": words, "default": list(there), "metavar": "NAME,..."}


def in_turn(numbers: Sequence[T], minutes: float = UNENDING) -> Iterator[T]:
    """Give one after the other, none after so many minutes."""
    until_s = time.monotonic() + 60.0 * minutes
    for number in numbers:
        if time.monotonic() > until_s:
            return
        yield number


@contextmanager
def workers(scheduler: str | None, jobs: int) -> Iterator[Executor]:
    """Give an executor of so many processes, or that of a cluster whose workers run the same versions."""
    if scheduler is None:
        with ProcessPoolExecutor(jobs) as pool:
            yield pool
        return
    from fingervision.batch.cluster import connected  # what needs no cluster needs nothing of the product

    with connected(scheduler) as client:
        yield client.get_executor(pure=False)


def answers(
    work: Callable[[T], R], tasks: Sequence[T], jobs: int, minutes: float = UNENDING, scheduler: str | None = None
) -> Iterator[tuple[T, R]]:
    """Give each task with its result as they come; after so many minutes, what has not begun is left out."""
    until_s = time.monotonic() + 60.0 * minutes
    with workers(scheduler, jobs) as pool:
        waiting: dict[Future[R], T] = {pool.submit(work, task): task for task in tasks}
        for future in as_completed(waiting):
            if time.monotonic() > until_s:
                for later in waiting:
                    later.cancel()
            if not future.cancelled():
                yield waiting[future], future.result()


def told(what: str, figure: str, bar: str = "", met: bool | None = None) -> None:
    """Print a line of a table: what, how much, the bar, and whether it is met."""
    print(f"{what:58} {figure:>22}  {bar:22} {'' if met is None else 'met' if met else 'MISSED'}", flush=True)


class Tally:
    """Counts of what came out, for each kind of case and for all, as a table with a line for each kind.

    Parameters
    ----------
    columns : str
        Names of what is counted, in the order of the table.
    """

    def __init__(self, *columns: str) -> None:
        self._columns = columns
        self.of: defaultdict[str, Counter[str]] = defaultdict(Counter)

    def add(self, kinds: Iterable[str], counts: Mapping[str, int] | Iterable[str]) -> None:
        """Count a case of one kind or several: how often each thing came out, or names of things that did."""
        for kind in (*kinds, "all"):
            self.of[kind].update(counts)

    def show(self) -> None:
        """Print the table; what is of several kinds stands in brackets, below the others."""
        wide = max(map(len, self.of), default=0) + 2
        print(" " * wide + "".join(f"{name:>{len(name) + 4}}" for name in self._columns))
        for kind, counts in sorted(self.of.items(), key=lambda each: (each[0] == "all", each[0].startswith("("))):
            print(f"{kind:{wide}}" + "".join(f"{counts[name]:{len(name) + 4}}" for name in self._columns))


def spent_s(work: Callable[[], object], times: int = 1) -> tuple[float, float]:
    """Seconds of the clock and of the processor, ended processes included, that work takes: medians."""
    found = []
    for _ in range(times):
        begun_s, used_s = time.perf_counter(), processor_s()
        work()
        found.append((time.perf_counter() - begun_s, processor_s() - used_s))
    walls, processors = zip(*found, strict=True)
    return median(walls), median(processors)


def processor_s() -> float:
    """Seconds of processor time of this process and of those that it has ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
