"""Boards for the tests of the bed: the real sketch, emulated."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.testbed.emulated_board import EmulatedBoard, compiled, missing_tools, running

# In slow motion, so that a loaded machine is fast enough for the emulated board.
SLOWER = 3


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
    with running(sketch, SLOWER) as board:
        yield board
