"""Damaged recordings: every frame passed on as undamaged shows the undamaged recording's picture of that time."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.damage import EvenRow, believable
from fingervision.frames.file_pictures import AviPlaces
from fingervision.frames.source_kinds import open_source
from tests import clips

RATE_HZ, COUNT, SIZE_PX = 25, 60, (96, 64)
GREY = {"ffv1": "gray", "mjpeg": "yuvj420p", "libx264": "yuv420p"}
FFV1 = {"level": "3", "slicecrc": "1"}


def film() -> list[NDArray[np.uint8]]:
    """A moving pattern over a resting pattern, so that all pictures differ."""
    x, y = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    still = np.random.default_rng(4).integers(0, 40, x.shape)
    return [(100 + 60 * np.sin((x + 1.7 * k) / 6.0) * np.cos(y / 7.0) + still).astype(np.uint8) for k in range(COUNT)]


def coded(path: Path, coder: str, **options: str) -> bytes:
    return clips.coded(path, film(), clips.Codec(coder, GREY[coder], options), rate_hz=RATE_HZ)


def packets(path: Path) -> list[bytes]:
    with av.open(str(path)) as container:
        return [bytes(packet) for packet in container.demux(video=0) if packet.size]


def read(path: Path) -> list[Frame | LostFrame]:
    return list(open_source(str(path)))


def nothing_wrong(path: Path, change: Callable[[bytearray], object]) -> tuple[list[Frame | LostFrame], int]:
    """Read the file with a fault; every undamaged frame must equal that of the intact file at the same time."""
    truth = {item.time_s: item.pixels for item in read(path) if isinstance(item, Frame)}
    assert len(truth) == COUNT
    content = bytearray(path.read_bytes())
    change(content)
    damaged = path.with_name(f"damaged{path.suffix}")
    damaged.write_bytes(content)
    found = read(damaged)
    whole = 0
    for item in found:
        if isinstance(item, Frame) and item.time_s is not None:
            np.testing.assert_array_equal(item.pixels, truth[item.time_s], f"frame {item.index}, {item.time_s} s")
            whole += 1
    return found, whole


def test_flips_in_frames_one_after_the_other_lose_each_of_them(tmp_path: Path) -> None:
    # Every frame by itself, as the recordings of live are.
    path = tmp_path / "clip.mkv"
    content = coded(path, "ffv1", g="1", **FFV1)
    coded_frames = packets(path)

    def flip(changed: bytearray) -> None:
        for frame in coded_frames[20:28]:
            changed[content.index(frame) + len(frame) // 2] ^= 4

    found, whole = nothing_wrong(path, flip)
    assert [item.index for item in found if isinstance(item, LostFrame)] == list(range(20, 28))
    assert whole == COUNT - 8


def test_a_key_frame_that_is_damaged_makes_nothing_whole(tmp_path: Path) -> None:
    path = tmp_path / "clip.mkv"
    content = coded(path, "ffv1", g="12", **FFV1)
    coded_frames = packets(path)

    def flip(changed: bytearray) -> None:
        for frame in (coded_frames[20], coded_frames[24]):
            changed[content.index(frame) + len(frame) // 2] ^= 4

    found, _ = nothing_wrong(path, flip)
    assert [item.index for item in found if isinstance(item, LostFrame)] == list(range(20, 36))


@pytest.mark.parametrize("coder", ["mjpeg", "ffv1"])
@pytest.mark.parametrize("removed", [False, True], ids=["zeroed", "missing"])
def test_a_hole_in_an_avi_moves_no_frame_in_time(tmp_path: Path, coder: str, removed: bool) -> None:
    path = tmp_path / "clip.avi"
    content = coded(path, coder, g="1", **(FFV1 if coder == "ffv1" else {}))
    coded_frames = packets(path)
    begin, end = content.index(coded_frames[20]) + 40, content.index(coded_frames[23]) + 40

    def hole(changed: bytearray) -> None:
        if removed:
            del changed[begin:end]
        else:
            changed[begin:end] = bytes(end - begin)

    found, whole = nothing_wrong(path, hole)
    assert whole >= COUNT - 8
    lost_s = {round(item.time_s, 3) for item in found if isinstance(item, LostFrame) and item.time_s is not None}
    assert {0.84, 0.88} <= lost_s


def test_behind_a_hole_in_an_avi_without_index_no_time_is_made_up(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    content = coded(path, "mjpeg")
    coded_frames = packets(path)
    begin, end = content.index(coded_frames[20]) + 40, content.index(coded_frames[23]) + 40

    def hole(changed: bytearray) -> None:
        changed[begin:end] = bytes(end - begin)
        changed[changed.rindex(b"idx1") :] = b""

    found, whole = nothing_wrong(path, hole)
    assert 19 <= whole <= 21
    behind = [item for item in found if isinstance(item, Frame) and item.time_s is None]
    assert COUNT - 25 <= len(behind) <= COUNT - 23
    assert any(
        "the times of the following frames are not known" in item.words for item in found if isinstance(item, LostFrame)
    )


def test_a_chunk_whose_length_is_damaged_is_no_other_frame_of_the_index(tmp_path: Path) -> None:
    # No byte is missing, so whatever lies elsewhere than the index says was never written.
    path = tmp_path / "clip.avi"
    content = coded(path, "mjpeg", qmin="3", qmax="3")
    frames = packets(path)
    sizes = [len(frame) for frame in frames]
    later = next(k for k in range(30, COUNT) if sizes.count(sizes[k]) == 1 and sizes[k] < sizes[20])

    def change(changed: bytearray) -> None:
        begin = content.index(frames[20])
        changed[begin - 4 : begin] = bytes(4)
        # Inside of the frame stands something that looks like a chunk of a later frame's length.
        changed[begin + 100 : begin + 108] = b"00dc" + sizes[later].to_bytes(4, "little")

    _, whole = nothing_wrong(path, change)
    assert whole >= COUNT - 3


def test_an_index_counts_from_where_the_chunks_lead_and_not_from_a_word_that_was_moved(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    content = coded(path, "mjpeg")
    page = (content.index(b"movi") // 2048) * 2048

    def change(changed: bytearray) -> None:  # a page with the head of the list of pictures, and one of pictures
        one, other = slice(page, page + 2048), slice(page + 8192, page + 10240)
        changed[one], changed[other] = content[other], content[one]

    nothing_wrong(path, change)


def test_a_name_that_is_damaged_in_the_index_moves_no_frame(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    content = coded(path, "mjpeg")
    frames = packets(path)

    def change(changed: bytearray) -> None:
        entry = changed.rindex(b"idx1") + 8 + 16 * 10
        changed[entry] ^= 1  # 00dc is 10dc
        begin = content.index(frames[20])
        changed[begin - 8 : begin] = bytes(8)

    _, whole = nothing_wrong(path, change)
    assert whole >= COUNT - 3


@pytest.mark.parametrize("first", [0, 20])
def test_frames_that_the_reader_skips_in_an_avi_without_index_are_counted(tmp_path: Path, first: int) -> None:
    path = tmp_path / "clip.avi"
    content = coded(path, "mjpeg")
    frames = packets(path)
    path.write_bytes(content[: content.rindex(b"idx1")])
    places = AviPlaces(path, 0, 1)
    begins = [content.index(frame) for frame in frames]
    assert [places.number(begins[k], len(frames[k])) for k in range(first)] == list(range(first))
    # The reader finds its way again three frames on; all chunks between are whole.
    assert places.number(begins[first + 3], len(frames[first + 3])) == first + 3


def test_frames_missing_right_at_the_start_of_a_transport_stream_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "clip.ts"
    coded(path, "libx264", g="30", bf="0", crf="18")
    with av.open(str(path)) as container:
        begins = [packet.pos for packet in container.demux(video=0) if packet.size]

    def lose(changed: bytearray) -> None:
        own = bytes(changed[begins[2] + 1 : begins[2] + 3])
        lost = 0
        for end in range(begins[2], len(changed), 188):
            # Sixteen packets of the stream, or a multiple: no counter tells.
            if lost and lost % 16 == 0 and end in begins:
                del changed[begins[2] : end]
                return
            lost += bytes(changed[end + 1 : end + 3])[1:] == own[1:]
        raise AssertionError("no such place")

    found, whole = nothing_wrong(path, lose)
    assert whole >= 2
    assert any(isinstance(item, LostFrame) for item in found)


def test_what_the_decoder_of_h264_says_in_its_log_alone_is_damage(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    content = coded(path, "libx264", g="20", bf="2", crf="18")
    coded_frames = packets(path)

    def spoil(changed: bytearray) -> None:
        frame = coded_frames[24]
        at = content.index(frame) + len(frame) // 3
        changed[at : at + 24] = np.random.default_rng(1).bytes(24)

    found, whole = nothing_wrong(path, spoil)
    assert whole >= 40
    assert whole < COUNT
    assert isinstance(found[-1], Frame)


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".avi"])
def test_a_picture_that_calls_itself_a_key_frame_by_a_flipped_bit_heals_nothing(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"clip{suffix}"
    content = coded(path, "libx264", g="30", bf="0", crf="18")
    frames = packets(path)

    def spoil(changed: bytearray) -> None:
        begin = content.index(frames[5])
        changed[begin + len(frames[5]) // 2 : begin + len(frames[5]) // 2 + 24] = bytes(24)
        begin = content.index(frames[9])
        # A slice's first byte is its kind: 1 of a picture that hangs on others, 5 of one that does not.
        assert changed[begin + 4] & 0x1F == 1
        changed[begin + 4] ^= 4

    _, whole = nothing_wrong(path, spoil)
    assert whole >= 30


@pytest.mark.parametrize("bit", [3, 12], ids=["out of the row", "far away"])
def test_a_frame_whose_time_is_damaged_is_no_frame_of_another_time(tmp_path: Path, bit: int) -> None:
    path = tmp_path / "clip.mkv"
    content = coded(path, "ffv1", g="1", **FFV1)
    frame = packets(path)[20]

    def spoil(changed: bytearray) -> None:
        # Before a frame stand its time in the cluster, two bytes, and one of flags.
        begin = content.index(frame) - 3
        changed[begin + (0 if bit > 7 else 1)] ^= 1 << bit % 8

    found, whole = nothing_wrong(path, spoil)
    assert whole >= COUNT - 3
    assert any(isinstance(item, LostFrame) for item in found)


@pytest.mark.parametrize("frame", [24, 38, 39, 40, 41])
def test_packets_lost_from_a_transport_stream_lose_frames_until_a_key_frame(tmp_path: Path, frame: int) -> None:
    path = tmp_path / "clip.ts"
    coded(path, "libx264", g="20", bf="2", crf="18")
    with av.open(str(path)) as container:
        begins = [packet.pos for packet in container.demux(video=0) if packet.size]

    def lose(changed: bytearray) -> None:
        del changed[begins[frame] : begins[frame] + 2 * 188]

    found, whole = nothing_wrong(path, lose)
    assert whole >= 20
    assert any(isinstance(item, LostFrame) for item in found)


def ticks_of(ticks: list[int], *, is_damaged: bool = True) -> list[int]:
    """Ticks of the pictures whose times are accepted."""
    blank = av.VideoFrame(16, 16, "gray")
    told = believable(((tick, blank) for tick in ticks), is_damaged=is_damaged)
    return [tick for tick, what in told if isinstance(what, av.VideoFrame)]


def test_a_single_time_out_of_an_even_row_is_not_believed_if_the_file_is_damaged() -> None:
    row = list(range(0, 1200, 40))
    assert ticks_of(row) == row
    late = [*row[:20], row[20] + 8, *row[21:]]
    assert ticks_of(late) == [*row[:20], *row[21:]]
    assert ticks_of(late, is_damaged=False) == late
    # Matroska's rounding, a frame that the camera dropped, a pause, and times that were never even are no damage.
    assert len(ticks_of([round(100 * k / 3) for k in range(30)])) == 30
    assert ticks_of([*row[:20], *row[21:]]) == [*row[:20], *row[21:]]
    paused = [*row[:20], *[tick + 517 for tick in row[20:]]]
    assert ticks_of(paused) == paused
    uneven = np.cumsum(np.random.default_rng(2).integers(1, 80, 200)).tolist()
    assert ticks_of(uneven) == uneven


def test_times_that_run_backwards_are_not_believed_and_a_repeated_one_is_left_alone() -> None:
    row = list(range(0, 1200, 40))
    assert ticks_of([*row[:15], 512, 552, *row[17:]]) == [*row[:14], *row[17:]]
    assert ticks_of([0, 40, 40, 80]) == [0, 40, 40, 80]


def test_frames_missing_in_an_even_row_are_noticed() -> None:
    row = EvenRow()
    assert [tick for tick in [*range(0, 800, 40), *range(880, 1200, 40)] if row.leaps(tick)] == [880]
    # Before there is a row, the rate that the stream states is one, from the first step that keeps it.
    stated, other = EvenRow(40.0), EvenRow(50.0)
    assert [tick for tick in (0, 40, 600, 640) if stated.leaps(tick)] == [600]
    assert [tick for tick in (0, 40, 600, 640) if other.leaps(tick)] == []
    # A camera that is late by a fifth of a step left nothing out.
    assert not any(row.leaps(tick) for tick in (1200, 1240, 1280, 1328, 1360))


def test_frames_cut_out_of_a_matroska_file_are_noticed_by_every_reading(tmp_path: Path) -> None:
    path = tmp_path / "cut.mkv"
    content = coded(path, "ffv1", **FFV1)
    path.write_bytes(content[: len(content) // 2] + content[len(content) // 2 + 5000 :])
    for _ in range(3):  # the reader of the file says the same of it each time
        found = read(path)
        (hole,) = [item.index for item in found if item.time_s is None]
        times_s = [[item.time_s for item in part if isinstance(item, Frame)] for part in (found[:hole], found[hole:])]
        assert len(found) < COUNT
        assert times_s[1][0] - times_s[0][-1] > 1.5 / RATE_HZ
