"""Run the code of plug-ins under a time limit."""

import ctypes
import os
import threading
from collections.abc import Callable
from math import isfinite
from typing import TypeVar

from fingervision.domain.errors import UsageError

T = TypeVar("T")

VARIABLE = "FINGERVISION_PLUGIN_SECONDS"
USUAL_S = 20.0
"""Default time limit in seconds: twice the time of the first import of a large library from a slow disk."""
LET_END_S = 0.5
"""Time in which code must end after the exception was raised in it."""


class OutOfTimeError(Exception):
    """The code was still running at its time limit."""


class _EndNow(BaseException):
    """Raised inside code that exceeds its time limit; not an `Exception`, so that `except Exception` misses it."""


def longest_s() -> float:
    """Time limit for the import of a plug-in (seconds).

    Raises
    ------
    UsageError
        The variable of the environment holds no positive number.
    """
    given = os.environ.get(VARIABLE, "")
    if not given:
        return USUAL_S
    try:
        seconds = float(given)
    except ValueError:
        seconds = -1.0
    if not (isfinite(seconds) and seconds > 0.0):
        raise UsageError(f"{VARIABLE} must be a positive number of seconds, but is '{given}': change or unset it.")
    return seconds


def within(seconds: float, act: Callable[[], T]) -> T:
    """Run a function in a separate thread under a time limit, and return the function's result.

    Code that still runs at its time limit is ended by an exception that is raised inside this code. Code that waits
    inside a compiled function cannot be ended by an exception; the code continues in the background, and does not
    prevent the program from ending.

    Parameters
    ----------
    seconds : float
        Time limit.
    act : callable
        Function without arguments.

    Raises
    ------
    OutOfTimeError
        The call took longer than the limit.
    BaseException
        Any exception that `act` raises.
    """
    results: list[T] = []
    raised: list[BaseException] = []

    def run() -> None:
        try:
            results.append(act())
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run, name="fingervision-plugin", daemon=True)
    thread.start()
    thread.join(seconds)
    if thread.is_alive():
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(_EndNow))
        thread.join(LET_END_S)
        raise OutOfTimeError
    if raised:
        raise raised[0]
    return results[0]
