"""Playback of a recording: every frame shown has the stated number, and measured values equal those of `measure`."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import cv2
import numpy as np
import pytest

import fingervision as fv
from calib.calibration import BareScale
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames import image_file, image_folder
from fingervision.frames.frame_range import frame_range
from fingervision.frames.image_folder import ImageFolder
from fingervision.frames.seeking import UNNUMBERED, frame_times_s
from fingervision.frames.source import FrameSource
from fingervision.frames.source_kinds import open_source
from fingervision.live.choices import Choices
from fingervision.live.commands import obey
from fingervision.live.comparison.comparison import Comparison
from fingervision.live.playback.playback import KEPT_BEFORE, FrameReader, OvertakenError, Playback
from fingervision.live.playback.recorded import is_recording, recorded
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.calibration_json import read_calibration
from tests.live.browser import browser, downloaded, opened, says, shown, typed
from tests.waiting import until

__all__ = ["browser", "opened"]
FRAMES, BITS, CELL_PX = 60, 6, 16


def numbered(number: int) -> np.ndarray:
    """A picture of a gripper with its number as black and white squares along the lower border."""
    rng = np.random.default_rng(number)
    picture = render(two_fingers(60.0 + number, frame=(320, 240)), Camera(blur_px=0.9, noise_grey=1.0), rng)
    for bit in range(BITS):
        picture[:CELL_PX, bit * CELL_PX : (bit + 1) * CELL_PX] = 255 if number >> bit & 1 else 0
    return np.asarray(picture)


def number_in(picture: np.ndarray) -> int:
    cells = [picture[4:12, bit * CELL_PX + 4 : (bit + 1) * CELL_PX - 4].mean() > 128 for bit in range(BITS)]
    return sum(1 << bit for bit, is_white in enumerate(cells) if is_white)


CODINGS = {
    "ffv1.mkv": ("-c:v", "ffv1"),
    "h264.mp4": ("-c:v", "libx264", "-g", "25", "-bf", "3", "-crf", "16", "-pix_fmt", "yuv420p"),
    "one_key.mp4": ("-c:v", "libx264", "-g", "600", "-crf", "16", "-pix_fmt", "yuv420p"),
    "mjpeg.avi": ("-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj420p"),
    # A camera whose times are uneven, and pictures that are coded in another order than they are shown.
    "uneven.mp4": ("-vf", "setpts=(N+0.3*mod(7*N\\,5))/25/TB", "-fps_mode", "vfr", "-bf", "3", "-pix_fmt", "yuv420p"),
}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One recording, stored with several codecs and as images."""
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed: it codes the recordings.")
    folder = tmp_path_factory.mktemp("recordings")
    images = folder / "images"
    images.mkdir()
    for number in range(FRAMES):
        cv2.imwrite(str(images / f"{number}.png"), numbered(number))
    for name, coding in CODINGS.items():
        source = ["-framerate", "25", "-start_number", "0", "-i", str(images / "%d.png")]
        subprocess.run(["ffmpeg", "-loglevel", "error", *source, *coding, str(folder / name)], check=True)
    return {path.name: path for path in folder.iterdir()}


@pytest.mark.parametrize("name", [*CODINGS, "images"])
def test_every_frame_is_the_one_it_says_in_any_order(recordings: dict[str, Path], name: str) -> None:
    source = open_source(str(recordings[name]))
    whole = [item for item in source if isinstance(item, Frame)]
    assert [number_in(item.pixels) for item in whole] == list(range(FRAMES))
    reader = FrameReader(lambda: iter(source), str(recordings[name]))
    order = [0, FRAMES - 1, 30, 29, 28, 5, 6, 7, *Random(1).sample(range(FRAMES), 10)]
    for wanted in order:
        # Asked for by its time where the table has one, and by counting.
        for time_s in (whole[wanted].time_s, None):
            found = reader.at(wanted, lambda _, time_s=time_s: time_s)
            assert isinstance(found, Frame)
            assert found.index == wanted
            assert number_in(found.pixels) == wanted
            np.testing.assert_array_equal(found.pixels, whole[wanted].pixels)
            reader._kept.clear()
    assert reader.at(FRAMES, lambda _: None) is None
    assert isinstance(reader.at(3, lambda _: None), Frame)


@pytest.mark.parametrize("name", CODINGS)
def test_frames_have_their_times_before_they_are_measured(
    recordings: dict[str, Path], tmp_path: Path, name: str
) -> None:
    source = open_source(str(recordings[name]))
    times_s = [item.time_s for item in source]
    assert frame_times_s(str(recordings[name])) == times_s
    # Without a scale nothing is measured: the packets alone tell which frame is the one of a time.
    view = Playback(recorded(str(recordings[name]), None, Choices(), ()), tmp_path / "out")
    view.start()
    try:
        until(lambda: [view.frame_at(time_s) for time_s in times_s] == [*range(FRAMES)])
    finally:
        view.stop()


class Counted:
    """A source that counts the frames that are read from it."""

    def __init__(self, source: FrameSource) -> None:
        self.description, self._source, self.read = source.description, source, 0

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        for item in self._source:
            self.read += 1
            yield item


def test_a_frame_that_is_asked_for_at_once_is_not_counted_from_the_beginning(
    recordings: dict[str, Path], tmp_path: Path
) -> None:
    opened_now = recorded(str(recordings["h264.mp4"]), None, Choices(), ())
    source = Counted(opened_now.source)
    view = Playback(replace(opened_now, source=source), tmp_path / "out")
    view.start()
    try:
        view.seek(FRAMES - 1)
        until(lambda: view.seen is not None and view.seen.frame.index == FRAMES - 1)
        assert view.seen is not None
        assert number_in(view.seen.frame.pixels) == FRAMES - 1
        assert source.read <= 1
    finally:
        view.stop()


def test_a_recording_is_shown_without_the_parts_that_it_does_not_need() -> None:
    heavy = ("fingervision.testbed", "fingervision.rendering", "fingervision.diagnosis", "skfem", "scipy.interpolate")
    program = (
        "import sys, fingervision.live.running\nfrom fingervision.live.commands import modules\nmodules()\n"
        f"print([name for name in {heavy!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["ffv1.mkv", "h264.mp4", "mjpeg.avi"])
def test_frames_of_a_damaged_recording_are_counted_where_packets_do_not_number_them(
    recordings: dict[str, Path], tmp_path: Path, name: str
) -> None:
    rng = Random(5)
    whole = recordings[name].read_bytes()
    for _ in range(6):
        place = rng.randrange(len(whole) // 10, len(whole))
        damaged = tmp_path / name
        damaged.write_bytes(whole[:place] + whole[place + rng.choice([3, 300, 3000]) :])
        try:
            source = open_source(str(damaged))
        except FingervisionError:
            continue  # an MP4 file whose index is gone
        times_s = [item.time_s for item in source]
        told = frame_times_s(str(damaged))
        assert told == times_s[: len(told)]


def test_a_time_that_no_frame_has_is_not_taken_for_a_neighbours(recordings: dict[str, Path]) -> None:
    source = open_source(str(recordings["h264.mp4"]))
    reader = FrameReader(lambda: iter(source), str(recordings["h264.mp4"]))
    found = reader.at(40, lambda _: 1.611)
    assert isinstance(found, Frame)
    assert number_in(found.pixels) == 40


def test_a_picture_that_was_put_back_is_read_again(recordings: dict[str, Path], tmp_path: Path) -> None:
    folder = tmp_path / "images"
    shutil.copytree(recordings["images"], folder)
    source = open_source(str(folder))
    reader = FrameReader(lambda: iter(source), str(folder), source)
    third = source.description.files[3]
    third.rename(tmp_path / "away")
    assert isinstance(reader.at(3, lambda _: None), LostFrame)
    (tmp_path / "away").rename(third)
    found = reader.at(3, lambda _: None)
    assert isinstance(found, Frame)
    assert number_in(found.pixels) == 3


def test_an_image_is_read_without_those_before_it(recordings: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    source = open_source(str(recordings["images"]))
    assert isinstance(source, ImageFolder)
    read: list[Path] = []
    monkeypatch.setattr(image_folder, "read_image", lambda file: read.append(file) or image_file.read_image(file))
    reader = FrameReader(lambda: iter(source), str(recordings["images"]), source)
    for wanted in (FRAMES - 1, 20, 50):
        found = reader.at(wanted, lambda _: None)
        assert isinstance(found, Frame)
        assert number_in(found.pixels) == found.index == wanted
    assert len(read) == 3
    assert reader.at(FRAMES, lambda _: None) is None


def test_frames_before_a_far_one_are_passed_kept_and_left_when_another_is_wanted(recordings: dict[str, Path]) -> None:
    source = open_source(str(recordings["one_key.mp4"]))
    whole = [item for item in source if isinstance(item, Frame)]
    read = Counted(source)
    reader = FrameReader(lambda: iter(read), str(recordings["one_key.mp4"]))

    def time_of(index: int) -> float | None:
        return whole[index].time_s

    passed: list[Frame] = []
    assert reader.at(40, time_of, passed.append) is not None
    assert [number_in(frame.pixels) for frame in passed] == [*range(40)]
    # To step back decodes nothing, and shows what the recording has there.
    again: list[Frame] = []
    for wanted in range(39, 39 - KEPT_BEFORE, -1):
        found = reader.at(wanted, time_of, again.append)
        assert isinstance(found, Frame)
        assert (found.index, found.time_s) == (wanted, whole[wanted].time_s)
        np.testing.assert_array_equal(found.pixels, whole[wanted].pixels)
    assert not again

    def overtaken(frame: Frame) -> None:
        again.append(frame)
        if len(again) == 5:
            raise OvertakenError

    reader._kept.clear()
    with pytest.raises(OvertakenError):
        reader.at(30, time_of, overtaken)
    assert len(again) == 5
    for wanted in (20, 55):
        found = reader.at(wanted, time_of)
        assert isinstance(found, Frame)
        assert number_in(found.pixels) == wanted
    assert read.read == 0


def test_the_first_frame_of_a_long_way_is_shown_meanwhile_as_what_it_is(
    recordings: dict[str, Path], tmp_path: Path
) -> None:
    view = Playback(recorded(str(recordings["one_key.mp4"]), None, Choices(), ()), tmp_path / "out")
    frames = [replace(item, index=UNNUMBERED) for item in view.recorded.source if isinstance(item, Frame)]
    view._times_s = frame_times_s(str(recordings["one_key.mp4"]))
    view._times_read.set()
    for wanted, shown_number in ((5, None), (40, 0)):
        view.frame, view.seen = wanted, None
        passes = view._on_the_way(wanted)
        for frame in frames[:3]:
            passes(frame)
        if shown_number is None:
            assert view.seen is None
        else:
            assert view.seen is not None
            assert view.seen.frame.index == number_in(view.seen.frame.pixels) == shown_number
    view.frame = 50
    with pytest.raises(OvertakenError):
        passes(frames[3])


def test_a_range_has_the_numbers_of_the_whole() -> None:
    frames = [Frame(np.zeros((2, 2), np.uint8), index, index / 10) for index in range(10)]
    read: list[int] = []

    def source() -> Any:
        for frame in frames:
            read.append(frame.index)
            yield frame

    assert [item.index for item in frame_range(source(), 3, 5)] == [3, 4, 5]
    assert read == [0, 1, 2, 3, 4, 5]
    assert list(frame_range(frames, 11, 12)) == []


def test_what_ends_is_a_recording_and_what_goes_on_is_none(recordings: dict[str, Path], tmp_path: Path) -> None:
    assert is_recording(str(recordings["ffv1.mkv"]))
    assert is_recording(str(recordings["images"] / "*.png"))
    for name in ("0", "simulated", "/dev/video0", "rtsp://127.0.0.1/x", "http://127.0.0.1/x?y", str(tmp_path / "no")):
        assert not is_recording(name)


@pytest.fixture
def playback(recordings: dict[str, Path], tmp_path: Path) -> Playback:
    """A recording without a scale, so that no measurement runs in the background."""
    return Playback(recorded(str(recordings["images"]), 25.0, Choices(), ()), tmp_path / "out")


def test_a_calibration_on_the_page_is_that_of_the_command(tmp_path: Path) -> None:
    widths_px, size_mm = (68.4, 136.8), (2.0, 4.0)
    rng = np.random.default_rng(8)
    for number, width_px in enumerate(widths_px):
        light = np.full((240, 320), 200.0)
        half = 4 * width_px / 2
        wide = np.full((240, 4 * 320), 200.0)
        wide[:, round(4 * 160 - half) : round(4 * 160 + half)] = 40.0
        light = cv2.GaussianBlur(wide.reshape(240, 320, 4).mean(axis=2), (0, 0), 1.2)
        cv2.imwrite(
            str(tmp_path / f"{number}.png"), np.round(light + rng.normal(0.0, 1.0, light.shape)).astype(np.uint8)
        )
    view = Playback(recorded(str(tmp_path / "*.png"), 25.0, Choices(), ()), tmp_path / "out")
    view.start()
    try:
        ask = {"do": "calibrate", "kind": "bar", "u_size_mm": 0.001, "box": [0, 0, 320, 240], "sure": True}
        for number in (0, 1):
            obey(view, {"do": "seek", "frame": number})
            until(lambda number=number: view.seen is not None and view.seen.frame.index == number)
            obey(view, {**ask, "size_mm": size_mm[number], "more": number == 0})
        pair = view.choices.scale
        obey(view, {**ask, "size_mm": size_mm[1]})
        single = view.choices.scale
    finally:
        view.stop()
    pictures = {tmp_path / f"{number}.png": size_mm[number] for number in (0, 1)}
    for found, references in ((pair, pictures), (single, {tmp_path / "1.png": size_mm[1]})):
        wanted = fv.calibrate("bar", references, u_size_mm=0.001, roi=(0, 0, 320, 240)).scale
        assert found.px_per_mm == wanted.px_per_mm
        np.testing.assert_array_equal(found.covariance, wanted.covariance)
        assert found.response_shift_px == wanted.response_shift_px != 0.0
        assert {part.source for part in found.parts} == {part.source for part in wanted.parts}


def test_wrong_wishes_are_refused_in_a_sentence(playback: Playback) -> None:
    refused = [
        {"do": "seek"},
        {"do": "seek", "frame": "three"},
        {"do": "seek", "frame": 1.5},
        {"do": "seek", "frame": 10**30},
        {"do": "step", "by": None},
        {"do": "play", "on": True, "speed": 0},
        {"do": "play", "on": True, "speed": float("nan")},
        {"do": "range", "first": 5, "last": 2},
        {"do": "range", "first": -1, "last": 2},
        {"do": "range", "first": 0, "last": FRAMES},
        {"do": "range", "first": True, "last": 3},
        {"do": "measure"},
        {"do": "record"},
        {"do": "height", "below_tip_mm": 0},
        {"do": "region", "box": [0, 0, 5000, 10]},
    ]
    for request in refused:
        with pytest.raises((UsageError, FingervisionError)):
            obey(playback, request)
    obey(playback, {"do": "seek", "frame": 10**9})
    assert playback.frame == FRAMES - 1
    obey(playback, {"do": "step", "by": -(10**9)})
    assert playback.frame == 0
    obey(playback, {"do": "range", "first": 3, "last": 3})
    assert playback.range == (3, 3)


def test_a_lost_frame_is_shown_as_lost(playback: Playback) -> None:
    from fingervision.domain.status import Status
    from fingervision.live.playback.recorded import recorded_frame

    lost = LostFrame(4, 0.16, Status.DAMAGED, "It could not be decoded.")
    seen = recorded_frame(lost, None, Choices(scale=BareScale(34.0)), playback.description)
    assert seen.row is not None
    assert (seen.row.status, seen.row.gap_mm, seen.row.frame) == (Status.DAMAGED, None, 4)
    assert np.ptp(seen.frame.pixels) == 0


@pytest.mark.parametrize("name", ["images", "ffv1.mkv"])
def test_a_recording_that_is_moved_away_while_it_plays_is_said_and_goes_on_when_it_is_back(
    recordings: dict[str, Path], tmp_path: Path, name: str
) -> None:
    path = tmp_path / name
    (shutil.copytree if recordings[name].is_dir() else shutil.copy)(recordings[name], path)
    view = Playback(recorded(str(path), 25.0 if path.is_dir() else None, Choices(), ()), tmp_path / "out")
    view.start()
    try:
        obey(view, {"do": "play", "on": True, "speed": 1.0})
        until(lambda: view.frame > 3)
        path.rename(path.with_suffix(".away"))
        # What the system still holds open plays on; a step back reads anew.
        until(lambda: view.frame > 5 or bool(view.supervisor.trouble))
        obey(view, {"do": "play", "on": False, "speed": 1.0})
        obey(view, {"do": "seek", "frame": 40})
        obey(view, {"do": "seek", "frame": 1})
        until(lambda: bool(view.supervisor.trouble) or (view.seen is not None and view.seen.frame.index == 1))
        if path.is_dir() or view.supervisor.trouble:
            assert "cannot be read any more" in view.supervisor.trouble
            assert path.name in view.supervisor.trouble
        path.with_suffix(".away").rename(path)
        obey(view, {"do": "seek", "frame": 7})
        until(lambda: view.seen is not None and number_in(view.seen.frame.pixels) == 7 and not view.supervisor.trouble)
    finally:
        view.stop()


def frames_of(measured: Path) -> list[int]:
    return [int(line.split(",")[0]) for line in measured.read_text().splitlines()[1:]]


@pytest.mark.slow
def test_what_the_page_measures_is_what_the_command_gives(
    live: Callable[..., Any],
    opened: Callable[..., Any],
    measured: Callable[..., str],
    recordings: dict[str, Path],
    tmp_path: Path,
) -> None:
    moved = tmp_path / "h264.mp4"
    shutil.copy(recordings["h264.mp4"], moved)
    view = live(moved, "--px-per-mm", "34", "--port", "0")
    page = opened(view.address, viewport={"width": 1280, "height": 720})
    shown(page, f"document.querySelector('#place').textContent === 'frame 0 of {FRAMES}'")
    saved = downloaded(page, lambda: page.locator("body").press("c"))
    assert saved.read_text() == measured(moved, "--px-per-mm", "34")

    # Step, scrub, and play: the value is the table's of the frame that is shown.
    table = saved.read_text().splitlines()[1:]
    gap_mm = [float(line.split(",")[3]) for line in table]

    def at_frame(number: int) -> None:
        shown(page, f"document.querySelector('#gap_mm').dataset.frame === '{number}'")
        assert float(page.inner_text("#gap_mm")) == pytest.approx(gap_mm[number], abs=0.00005)

    page.locator("body").press("ArrowRight")
    at_frame(1)
    page.locator("body").press("Shift+ArrowRight")
    at_frame(26)
    page.locator("body").press("[")
    page.locator("#scrub").fill("40")
    at_frame(40)
    page.locator("#scrub").evaluate("each => each.blur()")
    page.locator("body").press("]")
    shown(page, "document.querySelector('#range').textContent === 'marked 26 to 40'")
    page.locator("body").press("End")
    at_frame(FRAMES - 1)
    page.locator("body").press(" ")
    shown(page, "document.querySelector('#play').textContent === 'Stand'")
    shown(page, "document.querySelector('#play').textContent === 'Play'")
    at_frame(FRAMES - 1)
    page.locator("body").press("i")
    page.locator("#step_pictures img").first.wait_for()

    page.locator("body").press("m")
    says(page, "15 frames measured")
    (folder,) = view.out.glob("measured_*_26_40")
    whole = tmp_path / "by_command"
    command = [sys.executable, "-m", "fingervision", "measure", str(moved), "--px-per-mm", "34", "--frames", "26:40"]
    subprocess.run([*command, "--out", str(whole)], check=True, capture_output=True)
    assert (folder / "gaps.csv").read_bytes() == (whole / "gaps.csv").read_bytes()
    assert frames_of(folder / "gaps.csv") == list(range(26, 41))
    assert json.loads((folder / "summary.json").read_text())["settings"]["frames"] == [26, 40]

    # Another height measures all of it anew.
    typed(page, "#below_tip", "0.5")
    page.press("#below_tip", "Escape")
    # The table of before is let go, and the new one grows.
    shown(page, "document.querySelector('#place').textContent.includes('measured')")
    shown(page, f"document.querySelector('#place').textContent === 'frame {FRAMES - 1} of {FRAMES}'")
    again = downloaded(page, lambda: page.locator("body").press("c"))
    other = again.read_text()
    assert other == measured(moved, "--px-per-mm", "34", "--below-tip-mm", "0.5")

    # Taken away while it is looked at: said, and nothing else breaks.
    moved.rename(moved.with_suffix(".away"))
    typed(page, "#px_per_mm", "20")
    shown(page, "document.querySelector('#place').textContent.includes('There is no')")


@pytest.mark.slow
def test_the_verdict_of_a_recording_is_that_of_its_own_table(tmp_path: Path) -> None:
    """The clocks' offset is found from the motion: a table that does not say how surely has too small a U."""
    sample = Path(__file__).parents[2] / "sample_frames" / "opening"
    scale, log = read_calibration(sample / "calibration.json"), ("--drive", str(sample / "drive.csv"))
    view = Playback(recorded(str(sample / "opening.mp4"), None, Choices(scale=scale), log), tmp_path / "out")
    comparison = Comparison(view, sample / "simulation.csv")
    view.on_table = comparison.add_all
    view.start()
    try:
        found = until(lambda: comparison.verdicts.newest)
        assert view.table is not None
        alone = fv.diagnose(view.table, sample / "simulation.csv")
        # Measured anew with as many rows, at another scale: another verdict.
        view.choose(scale=BareScale(0.98 * scale.px_per_mm))
        again = until(lambda: comparison.verdicts.newest if comparison.verdicts.newest is not found else None)
    finally:
        comparison.stop()
        view.stop()
    play, wanted = (json.loads((Path(found.report).parent / "report.json").read_text())["effects"][0], alone.effects[0])
    assert play["parameters"]["play_mm"]["value"] == pytest.approx(wanted.parameters["play_mm"].value, rel=1e-6)
    assert play["parameters"]["play_mm"]["u"] == pytest.approx(wanted.parameters["play_mm"].u, rel=1e-6)
    assert again.rows == found.rows
    assert again.sentence != found.sentence
