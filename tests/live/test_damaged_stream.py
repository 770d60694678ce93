"""A damaged stream: every frame that was lost in the live view is lost in the recording, too."""

from dataclasses import asdict
from pathlib import Path

import av
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.errors import DeviceError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.network_stream import NetworkStream
from fingervision.frames.source_kinds import open_source
from fingervision.live.capture import Arrival, Capture, Ended
from fingervision.live.run_folder import RecordedFrame, RunFolder
from fingervision.live.supervisor import Supervisor
from fingervision.measuring import run_table
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from tests import clips

COUNT, RATE_HZ, SIZE_PX, SCALE = 60, 25, (160, 120), 17.0
CODERS = {
    "h264": clips.Codec("libx264", "yuv420p", {"g": "20", "bf": "0", "crf": "18"}),
    "vp9": clips.Codec(
        "libvpx-vp9", "yuv420p", {"g": "40", "deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}
    ),
    "av1": clips.Codec("libsvtav1", "yuv420p", {"g": "40", "preset": "10", "svtav1-params": "pred-struct=1"}),
    "mjpeg": clips.Codec("mjpeg", "yuvj420p", {"qmin": "3", "qmax": "3"}),
}


@pytest.fixture(scope="module")
def film() -> list[np.ndarray]:
    scenes = [two_fingers(50.0 + 0.5 * k, below_tip_px=5.1, width_px=25.0, frame=SIZE_PX) for k in range(COUNT)]
    return [render(scene, Camera(noise_grey=1.0), np.random.default_rng(k)) for k, scene in enumerate(scenes)]


def coded(path: Path, film: list[np.ndarray], coder: str, container_format: str | None = None) -> list[int]:
    """Write the video, and return the position of each packet in the file."""
    # A camera of an even clock that skips a picture: nothing is lost on the way.
    ticks = [k + int(coder in ("vp9", "av1") and k > 50) for k in range(len(film))]
    clips.coded(path, film, CODERS[coder], rate_hz=RATE_HZ, ticks=ticks, container_format=container_format)
    if container_format == "mpjpeg":
        return []
    with av.open(str(path)) as container:
        return [packet.pos for packet in container.demux(video=0) if packet.size]


def recorded(stream: Path, out: Path, task: Task) -> Path:
    """Record a stream frame by frame, in the same way as the live view."""
    capture = Capture(NetworkStream(str(stream)), again=None)
    source = capture.source
    run = RunFolder(out, source.description, task, source.template)
    capture.start(Supervisor(lambda *_: None))
    capture.begin()
    while not isinstance(what := capture.next(5.0), Ended):
        if isinstance(what, Arrival):
            run.add(RecordedFrame(what.item, what.packets))
    run.close("The stream ended.")
    return run.path


@pytest.mark.slow
@pytest.mark.parametrize("coder", ["h264", "mjpeg"])
@pytest.mark.parametrize(("seed", "memory"), [(1, None), (2, None), (3, 0), (4, 0)])
def test_the_recording_of_a_lossy_stream_measures_to_the_live_table(
    tmp_path: Path,
    film: list[np.ndarray],
    coder: str,
    seed: int,
    memory: int | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if memory is not None:  # pictures are read again from the video
        monkeypatch.setattr(run_table, "MEMORY_WAITING", memory)
    stream = tmp_path / ("clip.ts" if coder == "h264" else "clip.mkv")
    begins = coded(stream, film, coder)
    content = bytearray(stream.read_bytes())
    for frame in sorted(np.random.default_rng(seed).choice(np.arange(3, COUNT - 3), 4, replace=False), reverse=True):
        if coder == "h264":
            del content[begins[frame] + 188 : begins[frame] + 2 * 188]
        else:
            content[begins[frame] + 700 : begins[frame] + 760] = bytes(60)
    stream.write_bytes(content)
    task = Task(BareScale(SCALE))
    run = recorded(stream, tmp_path / "runs", task)
    measure(open_source(str(run / "video.mp4")), task, tmp_path / "again")
    live, again = ((path / "gaps.csv").read_text() for path in (run, tmp_path / "again"))
    assert ",damaged," in live
    assert again == live


@pytest.mark.slow
@pytest.mark.parametrize("coder", ["vp9", "av1"])
def test_a_picture_that_the_camera_skipped_is_no_damage_in_its_recording(
    tmp_path: Path, film: list[np.ndarray], coder: str
) -> None:
    stream, task = tmp_path / "clip.mkv", Task(BareScale(SCALE))
    coded(stream, film, coder)
    run = recorded(stream, tmp_path / "runs", task)
    measure(open_source(str(run / "video.mp4")), task, tmp_path / "again")
    live, again = ((path / "gaps.csv").read_text() for path in (run, tmp_path / "again"))
    assert live.count(",ok,") >= 15  # the others are used up by probing, up to a key frame
    assert again == live


def test_one_damaged_jpeg_of_a_stream_without_times_costs_one_frame(tmp_path: Path, film: list[np.ndarray]) -> None:
    stream = tmp_path / "feed.mpjpeg"
    coded(stream, film, "mjpeg", "mpjpeg")
    whole = items_of(stream)
    content = bytearray(stream.read_bytes())
    at = [k for k in range(len(content)) if content.startswith(b"\xff\xda", k)][20] + 20
    content[at : at + 400] = b"\xff\xc4" * 200
    stream.write_bytes(content)
    items = items_of(stream)
    assert len(items) == len(whole)
    assert [item.index for item in items if isinstance(item, LostFrame)] == [19]  # the first is used up by probing


def test_times_behind_a_lost_header_stay(tmp_path: Path, film: list[np.ndarray]) -> None:
    # A picture without its header has no time; the host's is of another clock.
    stream = tmp_path / "clip.ts"
    begins = coded(stream, film, "h264")
    whole_s = {item.time_s for item in items_of(stream)}
    content = bytearray(stream.read_bytes())
    del content[begins[20] : begins[20] + 188]
    stream.write_bytes(content)
    items = items_of(stream)
    assert {item.time_s for item in items if isinstance(item, Frame)} <= whole_s
    times_s = [item.time_s for item in items if item.time_s is not None]
    assert times_s == sorted(times_s)
    assert times_s[-1] - times_s[0] < COUNT / RATE_HZ


def items_of(stream: Path) -> list[Frame | LostFrame]:
    items: list[Frame | LostFrame] = []
    with pytest.raises(DeviceError, match="is interrupted"):
        items.extend(NetworkStream(str(stream)))
    return items


@pytest.mark.slow
def test_what_was_lost_is_said_with_its_reason(tmp_path: Path, film: list[np.ndarray]) -> None:
    stream = tmp_path / "clip.ts"
    begins = coded(stream, film, "h264")
    content = bytearray(stream.read_bytes())
    del content[begins[30] + 188 : begins[30] + 2 * 188]
    stream.write_bytes(content)
    task = Task(BareScale(SCALE))
    run = recorded(stream, tmp_path / "runs", task)
    again = measure(open_source(str(run / "video.mp4")), task, tmp_path / "again")
    assert again.summary["why"]["damaged"]["words"]
    assert asdict(again.series.first_damaged)["frame"] in (29, 30, 31)  # the mark may be one too early
