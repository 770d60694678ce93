"""Missing packets of a codec that does not number pictures: dependent frames are reported as damaged, no others."""

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from fingervision.frames.missing_references import CodedTime, judged, missing_references
from tests.frames.test_missing_pictures import COUNT, coded, statuses, without, wrong

KINDS: dict[str, tuple[str, str, dict[str, str]]] = {
    "mpeg4": ("mpeg4", ".mp4", {"g": "20", "bf": "0"}),
    "mpeg4 between": ("mpeg4", ".mkv", {"g": "20", "bf": "2"}),
    "vp8": ("libvpx", ".webm", {"g": "20", "deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}),
    "vp9": ("libvpx-vp9", ".webm", {"g": "20", "cpu-used": "8"}),
    "vp9 resilient": (
        "libvpx-vp9",
        ".mp4",
        {"g": "20", "deadline": "realtime", "cpu-used": "8", "error-resilient": "1"},
    ),
    "ffv1": ("ffv1", ".mkv", {"g": "20", "level": "3", "slicecrc": "1"}),
    "av1": ("libsvtav1", ".mp4", {"g": "20", "preset": "10"}),
    "av1 in order": ("libsvtav1", ".mkv", {"g": "20", "preset": "10", "svtav1-params": "pred-struct=1"}),
}


@pytest.mark.parametrize("kind", KINDS)
def test_no_frame_that_hangs_on_a_missing_packet_is_whole(tmp_path: Path, kind: str) -> None:
    coder, suffix, options = KINDS[kind]
    path = tmp_path / f"clip{suffix}"
    truth = coded(path, coder, **options)
    assert statuses(path) == "." * COUNT
    rng = np.random.default_rng(len(kind))
    for gone in ({1}, {20}, {21}, *({int(k) for k in rng.choice(np.arange(1, COUNT - 2), 3)} for _ in range(2))):
        fewer = without(path, gone)
        assert wrong(fewer, truth) == [], gone
        assert statuses(fewer).count(".") >= (20 if len(gone) > 1 else COUNT - 20), gone


def row(ticks: "np.ndarray", key_every: int = 30) -> list[CodedTime]:
    """Packets without picture numbers, as in VP9."""
    return [CodedTime(int(tick), number % key_every == 0) for number, tick in enumerate(np.round(ticks))]


def variable_rates() -> dict[str, "np.ndarray"]:
    """Times of undamaged recordings in ticks of 1/90000 s, or of a millisecond."""
    rng, k = np.random.default_rng(11), np.arange(900)
    kept = k[rng.random(900) > 0.02]
    return {
        "phone": 3000.0 * kept + rng.normal(0.0, 27.0, kept.size),
        "quiet phone": 3000.0 * kept + rng.normal(0.0, 3.0, kept.size),
        "browser": 33.333 * kept + rng.normal(0.0, 2.0, kept.size),
        "some late": 40.0 * kept + np.where(rng.random(kept.size) < 0.05, 6.0, 0.0),
        "low light": np.cumsum(np.where(k // 100 % 2, 6000.0, 3000.0)),
        "exposure": np.cumsum(np.where(k // 150 % 2, 3750.0, 3000.0)),
        "still scenes left out": 40.0 * k[rng.random(900) > 0.5],
        "pause": 33.333 * k + np.where(k > 450, 3217.0, 0.0),
        "29.97 Hz": k * 1001.0 / 30.0,
        "240 Hz": k * 1000.0 / 240.0,
    }


@pytest.mark.parametrize("kind", variable_rates())
def test_sound_recordings_of_variable_rate_have_no_false_alarm(kind: str) -> None:
    assert judged(row(variable_rates()[kind])) == {}


def test_a_picture_between_two_of_which_one_came_hangs_on_a_missing_one() -> None:
    # Shown after all that came, with the last P picture of the file missing: no hole is left in the times.
    shown = [0, 3, 1, 2, 6, 4, 5, 9, 7, 8, 12, 10, 11, 15, 13, 14]
    packets = [CodedTime(40 * k, k == 0, is_needed=k % 3 == 0) for k in shown]
    assert judged(packets) == {}
    assert sorted(judged([each for each in packets if each.tick != 600])) == [13, 14]


@pytest.mark.parametrize("step", [40.0, 1000.0 / 30.0, 1000.0 / 240.0, 3003.0])
def test_every_hole_of_an_even_row_is_found(step: float) -> None:
    ticks = np.delete(np.arange(900) * step, [1, 47, 48, 300, 500, 501, 502])
    assert sorted(judged(row(ticks, 1000))) == [1, 46, 297, 496]


@pytest.mark.parametrize("lost", [None, 39])
def test_hidden_pictures_take_no_time(tmp_path: Path, lost: int | None) -> None:
    # VP8 codes some pictures only for others to hang on (RFC 6386, 9.1): times between the even ones are no damage.
    path, other = tmp_path / "clip.webm", tmp_path / "other.webm"
    coded(path, "libvpx", g="60", **{"cpu-used": "8", "deadline": "realtime"})
    hidden = {9, 29, 49}
    with av.open(str(path)) as whole, av.open(str(other), "w") as container:
        copied = container.add_stream_from_template(whole.streams.video[0], opaque=True)
        seen = 0
        for number, packet in enumerate(packet for packet in whole.demux(video=0) if packet.size):
            content = bytearray(bytes(packet))
            content[0] &= 0xFF if number not in hidden else 0xEF
            new = av.Packet(bytes(content))
            new.pts = new.dts = 40 * seen - (7 if number in hidden else 0)
            new.time_base, new.stream, new.is_keyframe = packet.time_base, copied, packet.is_keyframe
            if number != lost:
                container.mux(new)
            seen += number not in hidden
    damaged = 0 if lost is None else 60 - lost - 1 - len([k for k in hidden if k > lost])
    assert statuses(other).count("x") == damaged


def test_a_camera_that_paused_lost_nothing_as_its_key_frames_prove() -> None:
    # Every 12th coded picture is a key frame; the coder does not count the 27 that the camera never took.
    packets = row(40.0 * np.arange(120) + np.where(np.arange(120) > 65, 27 * 40.0, 0.0), 12)
    assert judged(packets) == {}
    for lost in (61, 63, 66, 70):
        assert len(judged(packets[:lost] + packets[lost + 1 :])) >= 1
    # As many as lie between two key frames may have been lost: then the count proves nothing.
    packets = row(40.0 * np.arange(120), 12)
    assert sorted(judged(packets[:66] + packets[78:])) == [66]


def test_a_hole_before_a_key_frame_harms_nothing() -> None:
    packets = row(np.delete(np.arange(100) * 40.0, 47), 1000)
    packets[47] = replace(packets[47], is_key=True)
    assert judged(packets) == {}


def test_codecs_that_count_are_left_to_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    coded(path, g="20", bf="0")
    fewer = without(path, {30})
    with av.open(str(fewer)) as container:
        assert missing_references(fewer, container.streams.video[0], container.format.name) == {}
