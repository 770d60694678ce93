"""Decoding ahead: order, errors, and the end when the reader stops."""

import threading
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.ahead import FRAMES_AHEAD, decoded_ahead


def numbered(count: int) -> Iterator[Frame | LostFrame]:
    for index in range(count):
        yield Frame(np.zeros((2, 2), np.uint8), index)


def decoders() -> int:
    return sum(thread.name == "decoder" for thread in threading.enumerate())


def test_every_frame_comes_once_and_in_order() -> None:
    assert [item.index for item in decoded_ahead(numbered(500))] == list(range(500))
    assert decoders() == 0


def test_an_error_comes_after_the_frames_before_it() -> None:
    def failing() -> Iterator[Frame | LostFrame]:
        yield from numbered(3)
        raise OSError("the stick was pulled out")

    seen = []
    with pytest.raises(OSError, match="pulled out"):
        seen.extend(item.index for item in decoded_ahead(failing()))
    assert decoders() == 0


def test_little_is_read_ahead_and_nothing_after_the_reader_leaves() -> None:
    read = []

    def watched() -> Iterator[Frame | LostFrame]:
        for item in numbered(1000):
            read.append(item.index)
            yield item

    frames = decoded_ahead(watched())
    assert [item.index for item in islice(frames, 5)] == list(range(5))
    frames.close()
    assert len(read) <= 5 + FRAMES_AHEAD + 2
    assert decoders() == 0
