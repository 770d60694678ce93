"""Jumps in a coded recording: real steps are accepted, jumps due to a damaged stream are not."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.source_kinds import open_source
from fingervision.measuring.sound_picture import SoundPictures, foreign_corners
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.clips import Codec, coded

SETTINGS = Settings(6.0)
SIZE_PX, COUNT = (320, 240), 12
BOTH = pytest.mark.parametrize("coding", [Coding.INTRAFRAME, Coding.INTERFRAME])


def picture(gap_px: float, seed: int = 0, **camera: float) -> np.ndarray:
    scene = two_fingers(gap_px, below_tip_px=6.0, width_px=60.0, frame=SIZE_PX)
    return render(scene, Camera(noise_grey=1.0, **camera), np.random.default_rng(seed))


def judged(frames: list[Frame]) -> list[GapMeasurement | NoGap | LostFrame]:
    pictures = SoundPictures()
    return [pictures.judged(frame, measure_frame(frame, SETTINGS)) for frame in frames]


def row(gaps_px: list[float], coding: Coding, change: Callable[[int, np.ndarray], None]) -> list[Frame]:
    """A video in which every eighth picture is a key frame."""
    frames = []
    for k, gap_px in enumerate(gaps_px):
        levels = picture(gap_px, k)
        change(k, levels)
        frames.append(Frame(levels, k, k / 25, coding, coding is Coding.INTERFRAME and k % 8 != 0))
    return frames


def wrong_level(levels: np.ndarray) -> None:
    levels[64:80, 120:136] = 200  # over the left finger's edge


def beside_the_edges(levels: np.ndarray) -> None:
    levels[80:96, 80:96] += np.uint8(40)  # within the left finger, 29 px from its inner edge


@pytest.mark.parametrize("damage", [wrong_level])
@BOTH
def test_foreign_squares_that_move_the_gap_are_damage(damage: Callable[[np.ndarray], None], coding: Coding) -> None:
    frames = row([50.0 + 0.5 * k for k in range(9)], coding, lambda k, levels: damage(levels) if k == 5 else None)
    plain = measure_frame(frames[5], SETTINGS)
    assert not isinstance(plain, GapMeasurement) or abs(plain.gap_px - 52.5) > 3.0 * plain.u_gap_px
    lost = [k for k, outcome in enumerate(judged(frames)) if isinstance(outcome, LostFrame)]
    # A picture that is coded as a difference takes those behind it along, until one that is not.
    assert lost == ([5] if coding is Coding.INTRAFRAME else [5, 6, 7])


def test_a_wrong_wave_in_a_square_has_its_corners_and_a_moved_edge_none() -> None:
    before, moved = (picture(gap_px).astype(np.float32) for gap_px in (50.0, 66.0))
    wave = before.copy()
    wave[64:72, 128:136] += 50.0 * np.cos(np.pi * (np.arange(8, dtype=np.float32) + 0.5) * 3 / 8)
    assert foreign_corners(wave, before, 13.0) >= 2
    assert foreign_corners(moved, before, 13.0) == 0
    assert foreign_corners(before, wave, 13.0) == 0  # the square is gone: this picture is the sound one


@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("levels", [np.uint8, np.uint16])
def test_stored_levels_have_the_corners_of_the_same_levels_as_floats(levels: type, is_turned: bool) -> None:
    rng = np.random.default_rng(7)
    before = picture(50.0).astype(levels)
    now = picture(50.0, 1).astype(levels)
    for _ in range(12):
        row, column, size = 8 * rng.integers(0, 28), 8 * rng.integers(0, 38), 8 * rng.integers(1, 3)
        now[row : row + size, column : column + size] += levels(rng.integers(3, 30))
    if is_turned:
        before, now = before.T, now.T
    found = [foreign_corners(now, before, least, levels_only=True) for least in (2.0, 6.0, 12.0)]
    assert found[0] > found[-1] > 0
    floats = now.astype(np.float32), before.astype(np.float32)
    assert found == [foreign_corners(*floats, least, levels_only=True) for least in (2.0, 6.0, 12.0)]


@BOTH
@pytest.mark.parametrize("step_px", [-24.0, 0.2, 8.0, 64.0])
def test_steps_and_vibrations_are_motion(coding: Coding, step_px: float) -> None:
    gaps_px = [80.0 + step_px * (k // 5 % 2) + 2.0 * np.sin(2.6 * k) * (k > 6) for k in range(COUNT)]
    frames = row(gaps_px, coding, lambda k, levels: None)
    outcomes = judged(frames)
    assert [type(outcome) for outcome in outcomes] == [GapMeasurement] * COUNT


@pytest.mark.parametrize("end", [80, SIZE_PX[1]])
def test_a_wrong_level_that_goes_on_to_the_end_of_a_jpeg_is_damage(end: int) -> None:
    # Its two corners lie far from the fingers (ITU-T T.81, F.1.2.1: levels are differences to the block before).
    def raised(k: int, levels: np.ndarray) -> None:
        if k == 6:
            levels[64:end, 24:] = np.minimum(levels[64:end, 24:], 155) + 100
            levels[80:end, :24] = np.minimum(levels[80:end, :24], 155) + 100

    outcomes = judged(row([70.0 - 0.5 * k for k in range(COUNT)], Coding.INTRAFRAME, raised))
    assert [isinstance(outcome, LostFrame) for outcome in outcomes] == [k == 6 for k in range(COUNT)]


@BOTH
def test_foreign_squares_that_move_no_edge_cost_no_frame(coding: Coding) -> None:
    frames = row([70.0] * COUNT, coding, lambda k, levels: beside_the_edges(levels) if k == 6 else None)
    before, changed = (frames[k].pixels[32:128].astype(np.float32) for k in (5, 6))
    assert foreign_corners(changed, before, 13.0) >= 2
    assert [type(outcome) for outcome in judged(frames)] == [GapMeasurement] * COUNT


@BOTH
def test_light_that_goes_off_and_a_hand_in_view_are_no_damage(coding: Coding) -> None:
    def change(k: int, levels: np.ndarray) -> None:
        if k in (4, 5):
            levels[:] = levels // 3
        if k == 8:
            levels[30:150, 90:141] = 90

    assert not [each for each in judged(row([70.0] * COUNT, coding, change)) if isinstance(each, LostFrame)]


def test_a_lossless_picture_is_believed_whatever_it_shows() -> None:
    frames = row([50.0] * COUNT, Coding.LOSSLESS, lambda k, levels: wrong_level(levels) if k == 6 else None)
    assert not [each for each in judged(frames) if isinstance(each, LostFrame)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coder", "options"),
    [
        *(("libx264", {"crf": str(crf), "g": "25"}) for crf in (18, 38)),
        *(("mjpeg", {"qmin": str(q), "qmax": str(q)}) for q in (3, 31)),
    ],
)
def test_sound_films_pass_however_coarse(tmp_path: Path, coder: str, options: dict[str, str]) -> None:
    path = tmp_path / "clip.mkv"
    kind = "yuv420p" if coder == "libx264" else "yuvj420p"
    levels = (picture(50.0 + 0.3 * k + 16.0 * (k // 5 % 2), k, blur_px=0.5) for k in range(24))
    coded(path, levels, Codec(coder, kind, options), dst_color_range="JPEG")
    assert not [each for each in judged(list(open_source(str(path)))) if isinstance(each, LostFrame)]
