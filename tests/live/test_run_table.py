"""The table of a run is that of its video: one camera, learnt from the run's own first frames."""

import weakref
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.camera import Origin
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.ahead import FRAMES_AHEAD
from fingervision.frames.source import Description
from fingervision.frames.source_kinds import open_source
from fingervision.live import frame_measurement
from fingervision.live.choices import Choices
from fingervision.live.frame_measurement import FrameMeasurement
from fingervision.live.run_folder import RecordedFrame, RunFolder
from fingervision.live.session import History
from fingervision.measuring import run_table
from fingervision.measuring.camera_learning import WANTED
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import measure_frame

COUNT, SIZE_PX, SCALE = 40, (160, 120), 17.0
DESCRIPTION = Description("camera", "camera", "raw", Coding.LOSSLESS, *SIZE_PX, 25.0, True, None)
# The computer may be loaded by other tests.
PATIENCE_S = 120.0


def coded_as_srgb(levels: np.ndarray) -> np.ndarray:
    light = levels / 255.0
    coded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * coded).astype(np.uint8)


@cache
def frame_of(k: int) -> Frame:
    scene = two_fingers(50.0 + 0.5 * k, below_tip_px=5.1, width_px=25.0, frame=SIZE_PX)
    levels = coded_as_srgb(render(scene, Camera(noise_grey=1.0), np.random.default_rng(k)))
    return Frame(levels, k + 7, 3.0 + k / 25.0, Coding.LOSSLESS)


def test_a_camera_that_is_being_learnt_when_a_run_begins_is_used_until_the_run_has_learnt_its_own(
    tmp_path: Path,
) -> None:
    view, choices = FrameMeasurement(SIZE_PX), Choices(BareScale(SCALE))
    assert choices.task is not None
    for k in range(WANTED):
        view.measured(frame_of(k), choices)
    run = RunFolder(tmp_path / "runs", DESCRIPTION, choices.task, None)
    assert view.settings is not None
    until_s = monotonic() + PATIENCE_S
    while view.settings.camera.response.origin is not Origin.LEARNT and monotonic() < until_s:
        sleep(0.02)
        view.measured(frame_of(WANTED), choices, run)
    run.close("The test ended.")
    assert view.settings.camera.response.origin is Origin.LEARNT
    assert run.camera is None


@pytest.mark.parametrize("kept_px", [frame_measurement.MOST_KEPT_PX, 0])
def test_rows_before_the_camera_is_known_are_measured_again_by_it(
    kept_px: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frame_measurement, "MOST_KEPT_PX", kept_px)
    again: list[GapRow] = []
    history = History()

    def take(rows: Sequence[GapRow], left_out: range) -> None:
        history.replace(rows, left_out)
        again.extend(rows)

    view, choices = FrameMeasurement(SIZE_PX, again=take), Choices(BareScale(SCALE))
    task = choices.task
    assert task is not None
    frames: dict[int, Frame] = {}
    until_s = monotonic() + PATIENCE_S
    while not again and monotonic() < until_s:
        frame = replace(frame_of(len(frames) % COUNT), index=len(frames))
        frames[frame.index] = frame
        _, _, row = view.measured(frame, choices)
        assert row is not None
        history.add(replace(row, input_mm=0.25))
        sleep(0.02)
    assert view.settings is not None
    assert view.settings.camera.response.origin is Origin.LEARNT
    assert len(again) >= WANTED
    rows = list(history.rows())
    for row in rows:
        found = measure_frame(frames[row.frame], view.settings)
        assert isinstance(found, GapMeasurement)
        assert row.gap_px is not None
        assert row.u_shift_px is not None
        assert row.input_mm == 0.25
        # What was not kept is as wrong as before, and says so.
        assert abs(row.gap_px - found.gap_px) <= (0.0 if kept_px else 1.1 * row.u_shift_px)
    assert kept_px or len(rows) > len(again)


def test_pictures_do_not_wait_in_memory_while_the_camera_is_learnt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_table, "MEMORY_WAITING", 0)  # the fewest: 16
    task, pictures = Task(BareScale(SCALE)), list[weakref.ref[np.ndarray]]()
    run = RunFolder(tmp_path / "runs", DESCRIPTION, task, None)
    for k in range(2 * COUNT):
        frame = frame_of(k % COUNT)
        frame = replace(frame, pixels=frame.pixels.copy(), index=k, time_s=k / 25.0)
        pictures.append(weakref.ref(frame.pixels))
        run.add(RecordedFrame(frame, ()))
        del frame
    # What waits, and the decoder's eight frames ahead; the learning keeps copies.
    assert sum(picture() is not None for picture in pictures) <= run_table.FRAMES_WAITING + FRAMES_AHEAD + 2
    run.close("The test ended.")
    measure(open_source(str(run.path / "video.mp4")), task, tmp_path / "again")
    live, again = ((path / "gaps.csv").read_text() for path in (run.path, tmp_path / "again"))
    assert live.count(",ok,") >= COUNT
    assert again == live


def test_a_run_whose_camera_becomes_known_on_the_way_has_the_table_of_its_video(tmp_path: Path) -> None:
    task = Task(BareScale(SCALE))
    run = RunFolder(tmp_path / "runs", DESCRIPTION, task, None)
    for k in range(COUNT):
        frame = frame_of(k)
        # As the view does: with what is known of the camera when a frame comes.
        settings = task.settings if run.camera is None else replace(task.settings, camera=run.camera)
        run.add(RecordedFrame(frame, (), (settings, measure_frame(frame, settings))))
    run.close("The test ended.")
    measure(open_source(str(run.path / "video.mp4")), task, tmp_path / "again")
    live, again = ((path / "gaps.csv").read_text() for path in (run.path, tmp_path / "again"))
    assert live.count(",ok,") == COUNT
    assert again == live
