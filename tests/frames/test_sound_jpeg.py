"""Motion JPEG with damaged codes: pictures whose missing parts the decoder filled in are reported as damaged."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from fingervision.domain.frame import LostFrame
from fingervision.frames.sound_jpeg import SoundJpeg
from tests.frames.test_damage import COUNT, coded, nothing_wrong, packets


def jpeg(seed: int = 0, **options: int) -> bytes:
    levels = cv2.GaussianBlur(np.random.default_rng(seed).integers(0, 255, (96, 128)).astype(np.uint8), (0, 0), 2.0)
    chosen = [cv2.IMWRITE_JPEG_QUALITY, 90, *(option for pair in options.items() for option in pair)]
    return bytes(cv2.imencode(".jpg", levels, chosen)[1])


def flipped(picture: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(picture)
    begin = picture.index(b"\xff\xda") + 12
    changed[int(rng.integers(begin, len(picture) - 2))] ^= 1 << int(rng.integers(0, 8))
    return bytes(changed)


def test_bytes_that_are_missing_or_zero_are_found() -> None:
    rng = np.random.default_rng(3)
    judge = SoundJpeg("mjpeg")
    judge.learn([jpeg(k) for k in range(16)])
    missed = 0
    for k in range(100):
        whole = jpeg(k)
        assert judge.fault(whole) == ""
        at = int(rng.integers(whole.index(b"\xff\xda") + 12, len(whole) - 70))
        changed = whole[:at] + (bytes(60) if k % 2 else b"") + whole[at + 60 :]
        missed += not judge.fault(changed)
    # By chance a wrong reading ends in the right byte: 60 bytes of some 2000 shift the end by as much, give or take.
    assert missed <= 5


def test_sound_pictures_of_odd_makes_are_sound() -> None:
    judge = SoundJpeg("mjpeg")
    whole = jpeg()
    begin = whole.index(b"\xff\xc4")
    without_tables = whole[:begin]
    at = begin
    while whole[at + 1] != 0xDA:
        length = 2 + int.from_bytes(whole[at + 2 : at + 4], "big")
        without_tables += b"" if whole[at + 1] == 0xC4 else whole[at : at + length]
        at += length
    without_tables += whole[at:]  # as many webcams send them
    for picture in (whole, whole + bytes(64), whole[:-2] + b"\xff\xff\xff" + whole[-2:], without_tables):
        assert judge.fault(picture) == ""


def test_a_camera_that_breaks_the_format_in_every_picture_is_left_alone() -> None:
    judge = SoundJpeg("mjpeg")
    pictures = [jpeg(k)[:-2] + bytes(40) + b"\xff\xd9" for k in range(30)]
    judge.learn(pictures)
    assert [judge.fault(picture) for picture in pictures] == [""] * 30


def test_damage_of_most_pictures_is_no_habit_of_the_camera() -> None:
    judge = SoundJpeg("mjpeg")
    rng = np.random.default_rng(7)
    pictures = [jpeg(k) for k in range(60)]
    for k in np.flatnonzero(rng.random(60) < 0.8):
        at = pictures[k].index(b"\xff\xda") + 12 + int(rng.integers(400))
        # Bytes that are missing, bytes of another picture, the end of the picture before, or no end.
        other = pictures[(k + 7) % 60]
        pictures[k] = (
            pictures[k][:at] + pictures[k][at + 60 :],
            pictures[k][:at] + other,
            other[-300:] + pictures[k],
            pictures[k][:at],
        )[k % 4]
    judge.learn(pictures)
    whole = [jpeg(k) == picture for k, picture in enumerate(pictures)]
    assert [not judge.fault(picture) for picture in pictures] == whole


def test_other_codecs_are_not_judged() -> None:
    assert SoundJpeg("h264").fault(b"no picture") == ""


@pytest.mark.parametrize("suffix", [".mkv", ".avi", ".mp4"])
def test_a_flipped_jpeg_in_a_recording_is_damaged_alone(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"clip{suffix}"
    content = coded(path, "mjpeg", qmin="3", qmax="3")
    frames = packets(path)
    rng = np.random.default_rng(1)
    judge = SoundJpeg("mjpeg")

    def flip(changed: bytearray) -> None:
        for number in (20, 31, 45):
            spoilt = frames[number]
            while not judge.fault(spoilt):
                spoilt = flipped(frames[number], rng)
            begin = content.index(frames[number])
            changed[begin : begin + len(spoilt)] = spoilt

    judge.learn(frames)
    found, whole = nothing_wrong(path, flip)
    assert [item.index for item in found if isinstance(item, LostFrame)] == [20, 31, 45]
    assert whole == COUNT - 3
