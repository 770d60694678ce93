"""Boards for the tests of the bed: the real sketch, emulated."""

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.testbed.emulated_board import EmulatedBoard, compiled, missing_tools, running

# In slow motion, so that a loaded machine is fast enough for the emulated board.
SLOWER = 3
PRIORITY = -10


@pytest.fixture(scope="session")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The emulator and the compiled sketch."""
    why = missing_tools()
    if why is not None:
        pytest.skip(why)
    return compiled(tmp_path_factory.mktemp("sketch"))


@pytest.fixture
def emulated(sketch: tuple[Path, Path]) -> Iterator[EmulatedBoard]:
    """A board that was just switched on."""
    with ahead_of_others(), running(sketch, SLOWER) as board:
        yield board


@contextmanager
def ahead_of_others() -> Iterator[None]:
    """Run before other processes, where that is allowed, and without the pauses of Python's garbage collection.

    Who drives a motor must not keep it waiting.
    """
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, PRIORITY)
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        with suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, 0, before)
