"""Import the code of plug-ins within a time limit, and report a failure in one sentence."""

import threading
from collections.abc import Callable
from typing import TypeVar

from fingervision.plugins.faults import (
    MisfitError,
    PluginError,
    PluginImportError,
    PluginShapeError,
    PluginTimeoutError,
)
from fingervision.plugins.origin import Origin
from fingervision.plugins.time_limit import OutOfTimeError, longest_s, within

T = TypeVar("T")
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
            f"{who} must be imported within {seconds:g} s, but was still running at this time limit and was stopped: "
            f"look for an endless loop; {origin.remedy}."
        ) from None
    except PluginError:
        raise
    except MisfitError as error:
        raise PluginShapeError(f"{who} {error}; {origin.remedy}.") from error
    except ModuleNotFoundError as error:
        raise PluginImportError(
            f"{who} could not be imported, as the module {error.name} is missing: install that module, or "
            f"{origin.remedy}."
        ) from error
    except (KeyboardInterrupt, MemoryError):
        raise
    except BaseException as error:
        said = f"{type(error).__name__}{f': {error}' if str(error) else ''}".replace("\n", " ")[:300].rstrip(".")
        raise PluginImportError(f"{who} could not be imported ({said}): {origin.remedy}.") from error
