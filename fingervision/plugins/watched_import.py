"""Import the code of plug-ins within a time limit, and report a failure in one sentence."""

import ctypes
import os
import threading
from collections.abc import Callable
from math import isfinite
from typing import TypeVar

from fingervision.domain.errors import UsageError, error_words
from fingervision.plugins.faults import (
    MisfitError,
    PluginError,
    PluginImportError,
    PluginShapeError,
    PluginTimeoutError,
)
from fingervision.plugins.origin import Origin

T = TypeVar("T")

# Run the code of plug-ins under a time limit.

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


HERE = threading.local()


def importing() -> bool:
    """Whether this thread is importing a plug-in; requests for parts then see only the built-in ones."""
    return bool(getattr(HERE, "importing", False))


def watched(who: str, origin: Origin, act: Callable[[], T]) -> T:
    """Run a plug-in's code within its time limit, and convert any exception to a plug-in error of one sentence.

    Parameters
    ----------
    who : str
        Beginning of the sentence, such as `The effect sticky of fv-demo 1.2`.
    origin : Origin
        Origin of the plug-in, which determines the advice in the message.
    act : callable
        Function that imports and checks the plug-in.

    Raises
    ------
    PluginError
        The plug-in raised an exception, did not finish, or does not meet the requirements of its group.
    """
    seconds = longest_s()

    def run() -> T:
        HERE.importing = True
        return act()

    try:
        return within(seconds, run)
    except OutOfTimeError:
        raise PluginTimeoutError(
            f"{who} must be imported and tried within {seconds:g} s, but was still running at this time limit and was "
            f"stopped: look for an endless loop at its top or in its functions; {origin.remedy}."
        ) from None
    except MisfitError as error:
        raise PluginShapeError(f"{who} {error}; {origin.remedy}.") from error
    except PluginError:
        raise
    except ModuleNotFoundError as error:
        raise PluginImportError(
            f"{who} could not be imported, as the module {error.name} is missing: install that module, or "
            f"{origin.remedy}."
        ) from error
    except (KeyboardInterrupt, MemoryError):
        raise
    except BaseException as error:
        raise PluginImportError(f"{who} could not be imported ({error_words(error)}): {origin.remedy}.") from error
