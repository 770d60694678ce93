"""Loops that are compiled to machine code, kept on disk from one run to the next."""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function when it is first called; it lets other threads run meanwhile.

    Sums may be taken in any order, so that they use the processor's vector units: the same machine always gives the
    same digits. Division by zero gives an infinity, as in NumPy. A compiled function may call others of its package.
    Where there is no place to keep the machine code, neither beside the file nor in the user's cache folder, it is made
    anew in every run.
    """
    return _made(function, {"fastmath": {"reassoc", "contract"}})


def compiled_as_written(function: Function) -> Function:
    """Compile as `compiled` does, with every sum in the order in which it stands, whatever the processor's vectors."""
    return _made(function, {})


def _made(function: Function, particular: dict[str, Any]) -> Function:
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", **particular}
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:
        return cast("Function", numba.njit(**options)(function))
    _forget_old(Path(function.__code__.co_filename), Path(dispatcher.stats.cache_path))
    return cast("Function", dispatcher)


@cache
def _forget_old(source: Path, kept: Path) -> None:
    """Throw away what is kept of a file if any file beside it is newer: Numba looks at the file itself alone."""
    newest = max(path.stat().st_mtime for path in source.parent.glob("*.py"))
    for index in kept.glob(f"{source.stem}.*.nbi"):
        # Another process that begins at the same time throws it away as well.
        with suppress(FileNotFoundError):
            if index.stat().st_mtime < newest:
                index.unlink()
