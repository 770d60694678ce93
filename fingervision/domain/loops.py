"""Loops compiled from C and called like Python functions; the compiled library is built at first use if missing."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain import loops_build
from fingervision.domain.errors import InstallationError

NAME = "_loops"


def loop(name: str) -> Callable[..., Any]:
    """Return one of the compiled loops of the package's .c files.

    The loop releases Python's global interpreter lock, so that other threads can run at the same time. The same input
    gives identical results on every computer, apart from exp, log and erf of the C library, because the compiler may
    not reorder sums.

    Parameters
    ----------
    name : str
        Name of the loop, which begins with the name of its .c file.

    Returns
    -------
    callable
        Function that takes contiguous arrays of exactly the types of the loop's arguments (`domain/loops.h`), and
        writes its results into the arrays provided for them.

    Raises
    ------
    InstallationError
        If the loops are not built and cannot be built here.
    """
    found: Callable[..., Any] = getattr(_library(), name)
    return found


def filled(run: Callable[..., Any], signal: NDArray[np.float64], *values: object) -> NDArray[np.float64]:
    """Run a compiled loop over one signal, sample by sample, and return its output; shape (n,)."""
    out = np.empty(signal.shape)
    run(np.ascontiguousarray(signal, dtype=np.float64), *values, out)
    return out


@cache
def _library() -> ModuleType:
    name = loops_build.library_name()
    places = list(_places())
    for place in places:
        if (place / name).exists():
            return _loaded(place / name)
    for place in places[1:]:
        try:
            place.mkdir(parents=True, exist_ok=True)
            loops_build.build(place / name)
        except loops_build.CannotBuildError as error:
            raise InstallationError(str(error)) from error
        except OSError:
            continue  # cannot be written to
        _forget_others(place, name)
        return _loaded(place / name)
    msg = (
        f"The loops in C must be built once, and kept in one of {', '.join(map(str, places[1:]))}, but none of these "
        f"can be written to: set XDG_CACHE_HOME to a folder that can be written to."
    )
    raise InstallationError(msg)


def _places() -> Iterator[Path]:
    """Folders in which the compiled library may lie: the installation, a source tree's `build`, or the user's cache."""
    yield loops_build.PACKAGE / "domain"
    kind = loops_build.native_platform()
    if (loops_build.PACKAGE.parent / "pyproject.toml").exists():
        yield loops_build.SOURCE_BUILD / kind
    own = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    with suppress(RuntimeError):  # no home
        yield Path(own or Path.home() / ".cache") / "fingervision" / kind


def _forget_others(place: Path, name: str) -> None:
    """Delete libraries that were built from older sources."""
    for path in place.glob(f"{NAME}-*"):
        if path.name != name:
            with suppress(OSError):  # another process uses the file, or has deleted it
                path.unlink()


def _loaded(path: Path) -> ModuleType:
    spec = spec_from_file_location(NAME, path, loader=ExtensionFileLoader(NAME, str(path)))
    if spec is None or spec.loader is None:
        msg = f"{path} must be a library of this Python, but is not: delete the file, and it is built again."
        raise InstallationError(msg)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
