"""Tolerance: a gap is inside or outside only beyond its uncertainty; invalid settings give an error sentence."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib.calibration import BareScale
from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Region
from fingervision.frames.simulated import SimulatedGripper
from fingervision.live.choices import Choices

DESCRIPTION = SimulatedGripper((640, 480), 25.0).description


@given(st.floats(0.0, 5.0), st.floats(0.0, 0.5))
def test_pass_and_fail_are_sure_and_what_is_between_is_unsure(gap_mm: float, u_mm: float) -> None:
    verdict = Choices(least_mm=1.0, greatest_mm=2.0).verdict(gap_mm, u_mm)
    low, high = gap_mm - 2 * u_mm, gap_mm + 2 * u_mm
    expected = "pass" if low >= 1.0 and high <= 2.0 else "fail" if high < 1.0 or low > 2.0 else "unsure"
    assert verdict == expected


def test_without_limits_or_gap_there_is_no_verdict() -> None:
    assert Choices().verdict(1.0, 0.1) == ""
    assert Choices(least_mm=1.0).verdict(None, None) == ""


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        (
            Choices(region=Region(600, 0, 100, 100)),
            "The region must lie inside the frame of 640x480 pixels",
        ),
        (Choices(scale=BareScale(34.0), below_tip_mm=-1.0), "--below-tip-mm must be positive, but is -1."),
        (
            Choices(least_mm=2.0, greatest_mm=1.0),
            "The lower limit must be below the upper limit, but the limits are 2",
        ),
    ],
)
def test_what_cannot_be_meant_is_a_sentence(choices: Choices, words: str) -> None:
    with pytest.raises(UsageError) as refused:
        choices.for_frames(DESCRIPTION)
    assert str(refused.value).startswith(words)
