"""Frames without fingers in a recording that is compressed too far: the advice names the compression."""

from pathlib import Path

import pytest

from fingervision.domain.frame import Coding
from fingervision.domain.status import Status
from fingervision.frames.source import Description
from fingervision.measuring.series import GapSeries
from fingervision.measuring.summary import LEAST_BITS_A_PIXEL, _about_unseen


@pytest.mark.parametrize(
    ("bits", "coding", "status", "is_said"),
    [
        (0.1 * LEAST_BITS_A_PIXEL, Coding.INTERFRAME, Status.NO_FINGERS, True),
        (2.0 * LEAST_BITS_A_PIXEL, Coding.INTERFRAME, Status.NO_FINGERS, False),
        (0.1 * LEAST_BITS_A_PIXEL, Coding.LOSSLESS, Status.NO_FINGERS, False),
        (0.1 * LEAST_BITS_A_PIXEL, Coding.INTERFRAME, Status.OK, False),
    ],
)
def test_compression_is_named_where_it_may_be_the_cause(
    bits: float, coding: Coding, status: Status, is_said: bool, tmp_path: Path
) -> None:
    file = tmp_path / "film.mp4"
    file.write_bytes(bytes(round(bits * 640 * 480 * 10 / 8)))
    described = Description("film.mp4", "video", "h264", coding, 640, 480, 25.0, True, 10, (file,))
    series = GapSeries()
    series.counts[Status.OK], series.counts[status] = 3, series.counts[status] + 7
    said = _about_unseen(described, series)
    assert bool(said) == is_said
    if is_said:
        assert "7 of 10" in said[0]
        assert f"{bits:.2g} bit" in said[0]
