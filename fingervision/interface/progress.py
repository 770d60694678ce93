"""Progress bars, on a terminal and in a notebook."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fingervision.domain.errors import ArgumentError

Bar = Callable[..., None]
"""Called with what is done, and with the whole where it is known."""
_SHARE = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"


@contextmanager
def shown(progress: Bar | bool | None, words: str, unit: str = "") -> Iterator[Bar | None]:
    """Give the function that takes the progress of some work.

    Parameters
    ----------
    progress : callable, bool or None
        The user's function; or True for a bar with the time that is left, which appears only where a person looks on:
        on a terminal and in a notebook.
    words : str
        What is done, written before the bar.
    unit : str
        What is counted, in the plural; empty for a share of the work, from 0 to 1.

    Raises
    ------
    ArgumentError
        `progress` is neither a function nor a bool.
    """
    if callable(progress) or not progress:
        yield progress if callable(progress) else None
        return
    if progress is not True:
        raise ArgumentError("progress", "be a function or True", f"is {progress!r}")
    if not (sys.stderr.isatty() or "ipykernel" in sys.modules):
        yield None
        return
    from tqdm.auto import tqdm

    class Quiet(tqdm):  # type: ignore[misc]  # the library carries no types
        """A bar without the thread by which tqdm watches for bars that stand still."""

        monitor_interval = 0

    told: dict[str, Any] = {"unit": f" {unit}"} if unit else {"bar_format": _SHARE, "total": 1.0}
    with Quiet(desc=words, file=sys.stderr, **told) as bar:

        def show(done: float, whole: float | None = bar.total) -> None:
            if whole != bar.total:
                bar.reset(whole)
            # What continues earlier work may report less than before.
            bar.update(max(0.0, done - bar.n))

        yield show
