"""Linear algebra on one thread, where matrices are small: several threads would take two to four times the time."""

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """Return a context within which BLAS uses one thread of this process."""
    found: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return found


@cache
def _controller() -> ThreadpoolController:
    """Controller of the libraries' threads; finding them takes milliseconds."""
    return ThreadpoolController()
