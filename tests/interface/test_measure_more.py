"""`fingervision.measure`: the budget of a gap, ranges of frames, gauges, and a drive whose clock is not found."""

import json
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.rendering import Camera, render, two_fingers
from tests.commands import printed

OPENING = Path(__file__).parents[2] / "sample_frames" / "opening"
SCALE = 34.0


@pytest.fixture(scope="module")
def part() -> fv.Measurement:
    """Frames 4 to 9 of a recording, with a calibration and a gauge."""
    return fv.measure(
        OPENING / "opening.mp4",
        calibration=OPENING / "calibration.json",
        frames=(4, 9),
        gauges=OPENING / "gauges.toml",
    )


def test_the_parts_add_in_square_to_the_stated_uncertainty(part: fv.Measurement) -> None:
    squares = sum(np.square(line.u_mm) for line in part.budget.lines)
    np.testing.assert_allclose(np.sqrt(squares), part.u_gap_mm, rtol=1e-12)
    random = sum(np.square(line.u_mm) for line in part.budget.lines if not line.shared)
    np.testing.assert_allclose(np.sqrt(random), part.u_random_mm, rtol=1e-12)


def test_summary_states_the_parts(part: fv.Measurement) -> None:
    parts = part.summary["uncertainty"]["parts"]
    assert parts == sorted(parts, key=lambda each: -each["rms_u_mm"])
    whole = sum(each["rms_u_mm"] ** 2 for each in parts)
    assert whole == pytest.approx(float(np.mean(np.square(part.u_gap_mm))), rel=1e-5)  # parts are rounded to 1e-9 mm
    assert {"random", "shared"} == {each["kind"] for each in parts}
    assert all(each["source"] and each["from"] for each in parts)
    json.dumps(parts, allow_nan=False)


def test_a_stated_scale_leaves_what_the_picture_shows() -> None:
    picture = render(two_fingers(68.0, below_tip_px=10.2), Camera(), np.random.default_rng(1))
    measured = fv.measure(picture, px_per_mm=SCALE)
    assert measured.u_gap_mm is None
    assert [line.source for line in measured.budget.lines if not line.shared] == ["edge noise"]
    np.testing.assert_allclose(measured.budget.u_random_mm, measured.u_random_mm)


def test_no_gap_has_no_budget() -> None:
    measured = fv.measure(np.full((200, 300), 128, np.uint8), px_per_mm=SCALE)
    with pytest.raises(fv.UsageError):
        _ = measured.budget
    assert measured.summary["uncertainty"]["parts"] == []


def test_a_range_keeps_the_numbers_of_the_recording(part: fv.Measurement) -> None:
    assert [row.frame for row in part] == [4, 5, 6, 7, 8, 9]
    assert part.picture(6).ndim == 3
    for outside in (3, 10):
        with pytest.raises(fv.UsageError, match=str(outside)):
            part.picture(outside)


@pytest.mark.parametrize("frames", [(9, 4), (-1, 3), (1, 2, 3), "1:3", (0.5, 2), [4]])
def test_refuses_what_is_no_range(frames: object) -> None:
    with pytest.raises(fv.ArgumentError, match="frames"):
        fv.measure(OPENING / "opening.mp4", px_per_mm=SCALE, frames=frames)


@pytest.mark.parametrize("gauges", [[], 3, {"a": 1}, [None]])
def test_refuses_what_are_no_gauges(gauges: object) -> None:
    with pytest.raises(fv.ArgumentError, match="gauges"):
        fv.measure(OPENING / "opening.mp4", px_per_mm=SCALE, gauges=gauges)


@pytest.mark.slow
def test_gauges_and_range_are_those_of_the_command(tmp_path: Path, part: fv.Measurement) -> None:
    options = ["--calibration", str(OPENING / "calibration.json"), "--frames", "4:9", "--overlay"]
    arguments = ["measure", str(OPENING / "opening.mp4"), *options, "--gauges", str(OPENING / "gauges.toml")]
    printed(*arguments, "--out", str(tmp_path / "command"))
    part.save(tmp_path / "function", overlay=True)
    for name in ("gaps.csv", "gauges.csv", "overlay.mp4"):
        assert (tmp_path / "function" / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name
    told = [json.loads((tmp_path / which / "summary.json").read_text()) for which in ("function", "command")]
    for summary in told:
        del summary["made_at"]
    assert told[0] == told[1]
    assert part.gauge_rows


def test_a_clock_that_is_not_found_leaves_the_gaps(tmp_path: Path) -> None:
    """The gaps are there, and why they have no input is said; what needs the input raises it."""
    camera, rng = Camera(noise_grey=2.0), np.random.default_rng(4)
    still = np.stack([render(two_fingers(68.0, below_tip_px=10.2, frame=(240, 180)), camera, rng) for _ in range(6)])
    drive = {"time_s": [0.0, 0.5, 1.0], "input_mm": [0.0, 0.2, 0.0]}
    measured = fv.measure(still, px_per_mm=SCALE, rate_hz=10.0, drive=drive)
    assert measured.counts == {"ok": 6}
    assert measured.no_input is not None
    assert "drive_offset_s" in measured.no_input
    assert "--" not in measured.no_input
    assert measured.advice[0] == measured.no_input
    assert measured.no_input in measured.report()
    assert all(row.input_mm is None for row in measured)
    with pytest.raises(fv.DataError):
        measured.measured_table()
    with pytest.raises(fv.DataError):
        fv.compare(measured, {"input_mm": [0.0, 1.0], "gap_mm": [2.0, 2.5]})
    assert measured.save(tmp_path / "out").joinpath("gaps.csv").is_file()


def test_a_given_offset_beyond_the_drive_leaves_the_gaps() -> None:
    picture = render(two_fingers(68.0, below_tip_px=10.2), Camera(), np.random.default_rng(1))
    drive = {"time_s": [0.0, 0.5], "input_mm": [0.0, 0.2]}
    measured = fv.measure(np.stack([picture] * 2), px_per_mm=SCALE, rate_hz=10.0, drive=drive, drive_offset_s=100.0)
    assert measured.counts == {"ok": 2}
    assert measured.no_input is not None
