"""A complete measurement: known gaps are measured correctly, and the files describe the measurement."""

import json
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ExitCode, OutputError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame, Region
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.frames.arrays import ArrayFrames
from fingervision.frames.source import Description
from fingervision.measuring.measure import Measured, measure
from fingervision.measuring.task import Task
from fingervision.measuring.words import result_sentences
from fingervision.rendering import Camera, Scene, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.csv_rows import csv_rows

PX_PER_MM = 20.0
BELOW_PX = 0.3 * PX_PER_MM
CAMERA = Camera(blur_px=0.9, noise_grey=1.0)
# Six times the standard deviation of a gap at this noise and blur, in millimetres; bias included.
GAP_TOLERANCE_MM = 0.05 / PX_PER_MM


def opening(count: int, direction: Direction = Direction.UP) -> list[Scene]:
    return [
        two_fingers(60.0 + 2.5 * k, below_tip_px=BELOW_PX, width_px=40.0, direction=direction, frame=(240, 200))
        for k in range(count)
    ]


def rendered(scenes: list[Scene], seed: int = 0, rate_hz: float | None = 25.0) -> ArrayFrames:
    rng = np.random.default_rng(seed)
    return ArrayFrames(np.stack([render(scene, CAMERA, rng) for scene in scenes]), rate_hz)


def rows_of(measured: Measured) -> list[dict[str, str]]:
    return csv_rows(measured.folder.gaps)


@pytest.mark.parametrize(
    ("count", "rest", "code", "is_said_first"),
    [
        (1, "empty", ExitCode.COULD_NOT, True),
        (3, "empty", ExitCode.DONE, True),
        (1, "touching", ExitCode.DONE, True),
        (7, "empty", ExitCode.DONE, False),
    ],
)
def test_gaps_of_few_frames_are_not_those_of_the_recording(
    tmp_path: Path, count: int, rest: str, code: ExitCode, is_said_first: bool
) -> None:
    size_px = (240, 200)
    joined = two_fingers(-2.0, below_tip_px=BELOW_PX, width_px=70.0, radius_px=30.0, frame=size_px)
    others = {"empty": Scene((), *size_px), "touching": joined}
    scenes = [*opening(count), *[others[rest]] * (12 - count)]
    measured = measure(rendered(scenes), Task(BareScale(PX_PER_MM)), tmp_path)
    first = result_sentences(measured.summary, measured.series)[0]
    assert measured.series.counts[Status.OK] == count
    assert measured.exit_code is code
    assert f"{count} of 12" in first
    assert ("recording" in first) is is_said_first


@pytest.mark.parametrize("direction", list(Direction))
def test_the_true_gaps_come_out_in_millimetres(tmp_path: Path, direction: Direction) -> None:
    measured = measure(rendered(opening(5, direction)), Task(BareScale(PX_PER_MM)), tmp_path)
    rows = rows_of(measured)
    assert measured.exit_code is ExitCode.DONE
    truth = [(60.0 + 2.5 * k) / PX_PER_MM for k in range(5)]
    assert [float(row["gap_mm"]) for row in rows] == pytest.approx(truth, abs=GAP_TOLERANCE_MM)
    for row, gap_mm in zip(rows, truth, strict=True):
        # The scene is symmetric about the picture's middle, which is where millimetres start.
        assert float(row["left_mm"]) == pytest.approx(-gap_mm / 2, abs=GAP_TOLERANCE_MM)
        assert float(row["right_mm"]) == pytest.approx(gap_mm / 2, abs=GAP_TOLERANCE_MM)
        assert row["u_gap_mm"] == ""
        assert float(row["u_random_mm"]) == pytest.approx(float(row["u_gap_px"]) / PX_PER_MM, abs=1e-6)


def test_two_measurements_at_once_never_share_a_folder(tmp_path: Path) -> None:
    class Second(ArrayFrames):
        def __iter__(self) -> Iterator[Frame | LostFrame]:
            with pytest.raises(OutputError, match="in use by another run"):
                measure(rendered(opening(2)), Task(BareScale(PX_PER_MM)), tmp_path)
            yield from super().__iter__()

    first = Second(rendered(opening(3)).pictures, 25.0)
    measured = measure(first, Task(BareScale(PX_PER_MM)), tmp_path)
    assert len(rows_of(measured)) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gap.png", "gaps.csv", "summary.json"]


def test_a_region_changes_no_coordinate(tmp_path: Path) -> None:
    whole = measure(rendered(opening(2)), Task(BareScale(PX_PER_MM)), tmp_path / "whole")
    part = measure(rendered(opening(2)), Task(BareScale(PX_PER_MM), region=Region(20, 10, 200, 180)), tmp_path / "part")
    for row, other in zip(rows_of(whole), rows_of(part), strict=True):
        for name in ("gap_px", "left_x_px", "left_y_px", "right_mm", "left_tip_px"):
            assert float(other[name]) == pytest.approx(float(row[name]), abs=0.05), name


def test_the_drive_is_put_on_the_recordings_clock(tmp_path: Path) -> None:
    drive = DriveHistory(np.array([0.0, 1.0]), np.array([0.0, 10.0]), ("a", "a"), np.array([2.0, 4.0]))
    task = Task(BareScale(PX_PER_MM), drive=drive, drive_offset_s=0.04)
    rows = rows_of(measure(rendered(opening(3)), task, tmp_path))
    assert [(row["run"], row["input_mm"], row["force_n"]) for row in rows] == [
        ("", "", ""),
        ("a", "0", "2"),
        ("a", "0.4", "2.08"),
    ]


@dataclass(frozen=True)
class Items:
    """A recording whose frames are a list."""

    items: list[Frame | LostFrame]
    width_px: int = 240
    height_px: int = 200

    @property
    def description(self) -> Description:
        return Description(
            "list", "list", "none", Coding.LOSSLESS, self.width_px, self.height_px, None, True, len(self.items)
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        yield from self.items


def frames(count: int) -> list[Frame]:
    rng = np.random.default_rng(1)
    return [Frame(render(scene, CAMERA, rng), k, 0.04 * k) for k, scene in enumerate(opening(count))]


def test_every_frame_has_its_row_and_its_reason(tmp_path: Path) -> None:
    good = frames(4)
    black = Frame(np.zeros((200, 240), np.uint8), 1, 0.04)
    lost = LostFrame(2, 0.08, Status.DAMAGED, "It could not be decoded.")
    twice = LostFrame(3, 0.08, Status.DUPLICATE, "It has the same time as the frame before.")
    measured = measure(Items([good[0], black, lost, twice]), Task(BareScale(PX_PER_MM)), tmp_path)
    rows = rows_of(measured)
    assert [row["status"] for row in rows] == ["ok", "low_contrast", "damaged", "duplicate"]
    assert all(row["gap_mm"] == row["left_x_px"] == "" for row in rows[1:])
    assert measured.exit_code is ExitCode.DAMAGED_INPUT
    summary = json.loads(measured.folder.summary.read_text())
    assert summary["counts"]["ok"] == summary["counts"]["damaged"] == summary["counts"]["duplicate"] == 1
    assert summary["first_damaged"] == {"frame": 2, "time_s": 0.08, "words": "It could not be decoded."}
    assert summary["frames"] == 4


def test_without_a_number_the_table_is_written_all_the_same(tmp_path: Path) -> None:
    measured = measure(Items([Frame(np.zeros((200, 240), np.uint8), 0, 0.0)]), Task(BareScale(PX_PER_MM)), tmp_path)
    assert measured.exit_code is ExitCode.COULD_NOT
    assert [row["status"] for row in rows_of(measured)] == ["low_contrast"]
    assert measured.folder.figure.stat().st_size > 0


def test_the_overlay_keeps_the_times(tmp_path: Path) -> None:
    times_s = (0.0, 0.04, 0.05, 0.5)
    items: list[Frame | LostFrame] = [
        Frame(frame.pixels, frame.index, time_s) for frame, time_s in zip(frames(4), times_s, strict=True)
    ]
    measured = measure(Items(items), Task(BareScale(PX_PER_MM), overlay=True), tmp_path)
    with av.open(str(measured.folder.overlay)) as container:
        seen = list(container.decode(video=0))
    # MP4 keeps the 90 kHz clock to the tick.
    assert [picture.time for picture in seen] == pytest.approx(times_s, abs=1.0 / 90_000)
    colours = seen[0].to_ndarray(format="rgb24").astype(int)
    assert np.abs(colours[..., 0] - colours[..., 2]).max() > 50, "nothing is drawn in colour"


def test_a_stop_keeps_what_was_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = 0

    def pressed_after_six(frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
        nonlocal done
        outcome = measure_frame(frame, settings)
        done += 1
        if done == 6:
            signal.raise_signal(signal.SIGINT)
        return outcome

    monkeypatch.setattr("fingervision.measuring.changed_edges.measure_frame", pressed_after_six)
    measured = measure(rendered(opening(9)), Task(BareScale(PX_PER_MM)), tmp_path)
    assert measured.stopped
    assert measured.exit_code is ExitCode.COULD_NOT
    assert [row["frame"] for row in rows_of(measured)] == [str(k) for k in range(6)]
    assert json.loads(measured.folder.summary.read_text())["complete"] is False


def test_results_of_somebody_else_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "gaps.csv").write_text("mine\n")
    with pytest.raises(
        OutputError,
        match=r"already contains gaps\.csv, which was not written by an earlier "
        "measurement",
    ):
        measure(rendered(opening(1)), Task(BareScale(PX_PER_MM)), tmp_path)
    assert (tmp_path / "gaps.csv").read_text() == "mine\n"


def test_an_earlier_measurement_leaves_nothing_behind(tmp_path: Path) -> None:
    measure(rendered(opening(1)), Task(BareScale(PX_PER_MM), overlay=True), tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    measure(rendered(opening(1)), Task(BareScale(PX_PER_MM)), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gap.png", "gaps.csv", "notes.txt", "summary.json"]


@pytest.mark.parametrize("region", [Region(200, 0, 100, 50), Region(-1, 0, 10, 10), Region(0, 0, 0, 5)])
def test_a_region_outside_the_frame_is_refused(tmp_path: Path, region: Region) -> None:
    with pytest.raises(UsageError, match=r"--roi must lie inside the frame of 240x200 pixels, but is"):
        measure(rendered(opening(1)), Task(BareScale(PX_PER_MM), region=region), tmp_path)


def test_a_drive_needs_times(tmp_path: Path) -> None:
    drive = DriveHistory(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    with pytest.raises(UsageError, match="--drive needs a recording with times"):
        measure(rendered(opening(1), rate_hz=None), Task(BareScale(PX_PER_MM), drive=drive), tmp_path)


@pytest.mark.parametrize("below_tip_mm", [0.0, -0.3, float("nan"), float("inf")])
def test_the_height_must_be_positive(below_tip_mm: float) -> None:
    with pytest.raises(UsageError, match="--below-tip-mm must be positive, but is"):
        Task(BareScale(PX_PER_MM), below_tip_mm=below_tip_mm)


def test_progress_goes_up_to_the_end(tmp_path: Path) -> None:
    seen: list[tuple[int, int | None]] = []
    measure(rendered(opening(4)), Task(BareScale(PX_PER_MM)), tmp_path, lambda done, of: seen.append((done, of)))
    assert seen[-1] == (4, 4)
    assert all(before[0] <= after[0] for before, after in pairwise(seen))


def test_the_same_recording_gives_the_same_table(tmp_path: Path) -> None:
    tables = []
    for name in ("first", "second"):
        measured = measure(Items(list(frames(3))), Task(BareScale(PX_PER_MM)), tmp_path / name)
        tables.append(measured.folder.gaps.read_bytes())
    assert tables[0] == tables[1]
