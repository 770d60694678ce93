"""The quantiser steps of a stream are read for every block, at the block's position in the picture."""

import gc
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.domain.quantiser import BLOCK_PX, Quantiser
from fingervision.frames import decoded_picture
from fingervision.frames.decoded_picture import FADES, H264, VP9, VP9_STEPS, StatedSteps, StepTrail
from fingervision.frames.seeking import seeking
from fingervision.frames.source_kinds import open_source
from tests.frames.test_rotation import turn

HEIGHT, WIDTH = 72, 104  # neither is a multiple of 16


def drawn(number: int) -> NDArray[np.uint8]:
    rng = np.random.default_rng(number)
    picture = np.full((HEIGHT, WIDTH), 180.0)
    picture[20:, 30 + number : 60] = 40.0
    return np.clip(picture + rng.normal(0.0, 3.0, picture.shape), 0, 255).astype(np.uint8)


def recorded(path: Path, codec: str, options: dict[str, str], rotation_deg: int = 0) -> Path:
    with av.open(path, "w") as container:
        stream = container.add_stream(codec, rate=Fraction(25), options=options)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        if codec == "mpeg4":
            stream.codec_context.qmin = stream.codec_context.qmax = int(options["qscale"])
        if rotation_deg:
            turn(stream, rotation_deg)
        for number in range(3):
            picture = av.VideoFrame.from_ndarray(drawn(number), format="gray").reformat(format="yuv420p")
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def frames_of(path: Path) -> list[Frame]:
    return [item for item in open_source(str(path)) if isinstance(item, Frame)]


@pytest.mark.parametrize("parameter", [10, 28, 40])
def test_h264_of_one_quantiser_has_the_step_of_the_standard(tmp_path: Path, parameter: int) -> None:
    # ITU-T H.264, table of quantiser steps: 0.625 at 0, 2 at 10, 16 at 28, 64 at 40; B pictures may be coarser.
    options = {"qp": str(parameter), "x264-params": "aq-mode=0:bframes=0:ipratio=1:keyint=9"}
    for frame in frames_of(recorded(tmp_path / "clip.mkv", "libx264", options)):
        assert frame.quantiser is not None
        assert frame.quantiser.step.shape == (5, 7)
        assert np.allclose(frame.quantiser.step, {10: 2.0, 28: 16.0, 40: 64.0}[parameter], rtol=1e-3)


def test_mpeg4_leaves_alone_as_much_as_h264_of_twice_its_step(tmp_path: Path) -> None:
    frames = frames_of(recorded(tmp_path / "clip.avi", "mpeg4", {"qscale": "5"}))
    assert frames[0].quantiser is not None
    assert np.median(frames[0].quantiser.step) == 2.0 * 2.0 * 5.0


@pytest.mark.parametrize("codec", ["libx264", "libx265", "mpeg4", "ffv1"])
def test_decoded_pictures_leave_memory_without_the_collector(tmp_path: Path, codec: str) -> None:
    options = {"qscale": "5"} if codec == "mpeg4" else {"x265-params": "log-level=none"} if codec == "libx265" else {}
    path = recorded(tmp_path / "clip.mkv", codec, options)
    frames_of(path)  # what is made once, at the first file
    # What other tests have left behind takes several passes where one object's end releases the next, such as that of
    # a playback with its reader: it is no matter of these pictures.
    gc.freeze()
    gc.disable()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        count = len(frames_of(path))
        gc.collect()
        # The descriptions of a format refer to each other before PyAV 18; they hold no picture.
        kept = [type(each) for each in gc.garbage if isinstance(each, (av.VideoFrame, Frame, np.ndarray))]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()
        gc.unfreeze()
    assert count == 3
    assert not kept


def test_vp9_steps_end_where_the_format_does() -> None:
    assert VP9_STEPS.size == 256
    assert VP9_STEPS[0] == 0.5
    assert VP9_STEPS[-1] == 1828 / 8


def test_what_says_nothing_of_its_quantiser_has_none(tmp_path: Path) -> None:
    path = tmp_path / "clip.mkv"
    with av.open(path, "w") as container:
        stream = container.add_stream("ffv1", rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "gray"
        container.mux(stream.encode(av.VideoFrame.from_ndarray(drawn(0), format="gray")))
        container.mux(stream.encode(None))
    assert frames_of(path)[0].quantiser is None


@pytest.mark.parametrize("rotation_deg", [90, 180, -90])
def test_it_turns_with_the_picture(tmp_path: Path, rotation_deg: int) -> None:
    options = {"crf": "30", "x264-params": "aq-strength=2"}
    plain = frames_of(recorded(tmp_path / "plain.mkv", "libx264", options))[0].quantiser
    turned = frames_of(recorded(tmp_path / "turned.mkv", "libx264", options, rotation_deg))[0].quantiser
    assert plain is not None
    assert turned is not None
    pixels = np.repeat(np.repeat(plain.step, BLOCK_PX, 0), BLOCK_PX, 1)[:HEIGHT, :WIDTH]
    expected = np.rot90(pixels, rotation_deg // 90)
    found = np.array(
        [[turned.near(x, y, 0.0, 0.0) for x in range(expected.shape[1])] for y in range(expected.shape[0])]
    )
    assert np.array_equal(found, expected)


def test_a_frame_that_is_looked_up_has_the_same(tmp_path: Path) -> None:
    path = recorded(tmp_path / "clip.mkv", "libx264", {"crf": "30"})
    read = frames_of(path)[1]
    looked_up = seeking(str(path))
    assert looked_up is not None
    assert read.time_s is not None
    again = looked_up.frame(1, read.time_s)
    assert again is not None
    assert again.quantiser is not None
    assert read.quantiser is not None
    assert np.array_equal(again.quantiser.step, read.quantiser.step)


def test_the_coarsest_block_near_a_place_counts_and_a_part_keeps_its_places() -> None:
    whole = Quantiser(np.arange(12, dtype=np.float32).reshape(3, 4))
    assert whole.near(0.0, 0.0, 1.0, 1.0) == 0.0
    assert whole.near(15.0, 0.0, 1.0, 1.0) == 1.0
    assert whole.near(1e6, 1e6, 0.0, 0.0) == 11.0
    assert whole.seen_from(16, 32).near(0.0, 0.0, 0.0, 0.0) == 9.0
    assert whole.at(np.array([0.0, 40.0]), np.array([16.0, 3.0])) == 4.0
    assert whole.seen_from(16, 32).at(np.array([0.0, -1e6]), np.array([0.0, 0.0])) == 9.0


STATED = [[16.0, 4.0], [2.0, 8.0], [2.0, 2.0], [1.0, 1.0]]
KEPT = [[16.0, 4.0], [16.0 * FADES, 8.0], [16.0 * FADES**2, 8.0 * FADES], [1.0, 1.0]]


@pytest.mark.parametrize(("kind", "expected"), [(H264, KEPT), (VP9, STATED)])
def test_a_block_that_is_copied_keeps_the_step_that_coded_it(
    monkeypatch: pytest.MonkeyPatch, kind: int, expected: list[list[float]]
) -> None:
    """A skipped block of H.264 keeps the step of earlier pictures instead of its neighbour's, until a key frame; VP9
    decides by the picture's own step.
    """
    stated = iter(STATED)
    monkeypatch.setattr(
        decoded_picture,
        "stated_steps",
        lambda _: StatedSteps(Quantiser(np.array([next(stated)], dtype=np.float32)), kind),
    )
    trail, found = StepTrail(), []
    for is_key in (True, False, False, True):
        quantiser = trail.of(SimpleNamespace(key_frame=is_key))
        assert quantiser is not None
        found.append(quantiser.step[0])
    assert np.allclose(found, expected)
