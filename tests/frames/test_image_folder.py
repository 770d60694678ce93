"""Folders and globs of images: order, bit depth, times, and truncated images."""

from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, InputFileError, UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import FrameSource, Wish
from fingervision.frames.source_kinds import open_source


def noise(seed: int, shape: tuple[int, ...] = (30, 40), bits: int = 8) -> NDArray[np.uint8] | NDArray[np.uint16]:
    rng = np.random.default_rng(seed)
    if bits == 16:
        return rng.integers(0, 65536, shape, dtype=np.uint16)
    return rng.integers(0, 256, shape, dtype=np.uint8)


def save(path: Path, pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    path.write_bytes(cv2.imencode(path.suffix, pixels)[1].tobytes())


def pixels_of(item: Frame | LostFrame) -> NDArray[np.uint8] | NDArray[np.uint16]:
    assert isinstance(item, Frame), item
    return item.pixels


def frames_of(source: FrameSource) -> list[Frame | LostFrame]:
    return list(source)


# BMP holds 8 bits a colour.
@pytest.mark.parametrize(("suffix", "bits"), [(".bmp", 8), *product((".png", ".tif", ".tiff"), (8, 16))])
@pytest.mark.parametrize("colours", [1, 3, 4])
def test_lossless_images_come_back_exactly(tmp_path: Path, suffix: str, bits: int, colours: int) -> None:
    levels = noise(1, (30, 40) if colours == 1 else (30, 40, colours), bits)
    save(tmp_path / f"a{suffix}", levels)
    (item,) = frames_of(open_source(str(tmp_path)))
    # OpenCV's order is blue, green, red; alpha is left out.
    np.testing.assert_array_equal(pixels_of(item), levels if colours == 1 else levels[:, :, 2::-1])


def test_order_is_natural_and_other_files_are_left_out(tmp_path: Path) -> None:
    for number in (10, 2, 1, 100):
        save(tmp_path / f"frame{number}.png", np.full((4, 5), number, np.uint8))
    (tmp_path / "notes.txt").write_text("no image")
    save(tmp_path / ".hidden.png", np.zeros((4, 5), np.uint8))
    source = open_source(str(tmp_path))
    assert [int(pixels_of(item)[0, 0]) for item in source] == [1, 2, 10, 100]
    assert source.description.frame_count == 4


def test_a_glob_takes_what_it_matches(tmp_path: Path) -> None:
    for name in ("a1.png", "a2.png", "b1.png"):
        save(tmp_path / name, noise(2))
    assert [file.name for file in open_source(str(tmp_path / "a*.png")).description.files] == ["a1.png", "a2.png"]


def test_times_come_from_the_rate_or_the_table_or_not_at_all(tmp_path: Path) -> None:
    for number in range(3):
        save(tmp_path / f"{number}.png", noise(number))
    assert [item.time_s for item in open_source(str(tmp_path))] == [None, None, None]
    assert [item.time_s for item in open_source(str(tmp_path), Wish(rate_hz=4.0))] == [0.0, 0.25, 0.5]
    (tmp_path / "times.csv").write_text("# camera clock\ntime_s\n0.1\n0.35\n0.36\n")
    assert [item.time_s for item in open_source(str(tmp_path))] == [0.1, 0.35, 0.36]
    (tmp_path / "times.csv").write_text("file,time_s\n2.png,3\n0.png,1\n1.png,2\n")
    assert [item.time_s for item in open_source(str(tmp_path))] == [1.0, 2.0, 3.0]


def test_a_repeated_time_is_a_duplicate(tmp_path: Path) -> None:
    for number in range(3):
        save(tmp_path / f"{number}.png", noise(number))
    (tmp_path / "times.csv").write_text("time_s\n0\n0.04\n0.04\n")
    items = frames_of(open_source(str(tmp_path)))
    assert isinstance(items[2], LostFrame)
    assert items[2].status is Status.DUPLICATE


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("", "must have a header line with time_s, but is empty"),
        ("t\n1\n", "must have a column time_s, but has t"),
        ("time_s\n1\n", "must have a time for each of the 2 images, but has 1"),
        ("time_s\n1\nsoon\n", "time_s in line 3 of .* must be a number of seconds, but is 'soon'"),
        ("file,time_s\n0.png,1\n", r"has none for 1\.png"),
        ("file,time_s\n0.png\n", "Line 2 of .* must have 2 cells, but has 1"),
    ],
)
def test_a_bad_table_of_times_is_refused_in_a_sentence(tmp_path: Path, table: str, sentence: str) -> None:
    for number in range(2):
        save(tmp_path / f"{number}.png", noise(number))
    (tmp_path / "times.csv").write_text(table)
    with pytest.raises(DataError, match=sentence):
        open_source(str(tmp_path))


def test_a_rate_and_a_table_contradict_each_other(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    (tmp_path / "times.csv").write_text("time_s\n0\n")
    with pytest.raises(UsageError, match="leave out --rate-hz, or remove that table"):
        open_source(str(tmp_path), Wish(rate_hz=25.0))
    with pytest.raises(UsageError, match="--rate-hz must be positive, but is -1"):
        open_source(str(tmp_path), Wish(rate_hz=-1.0))


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".tif"])
def test_an_image_that_ends_early_is_damaged_and_the_rest_is_read(tmp_path: Path, suffix: str) -> None:
    for number in range(3):
        save(tmp_path / f"{number}{suffix}", noise(number))
    content = (tmp_path / f"1{suffix}").read_bytes()
    (tmp_path / f"1{suffix}").write_bytes(content[: len(content) // 2])
    items = frames_of(open_source(str(tmp_path)))
    assert [isinstance(item, Frame) for item in items] == [True, False, True]
    assert items[1].index == 1


def test_a_flipped_byte_in_a_png_fails_its_checksum(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    content = bytearray((tmp_path / "0.png").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "1.png").write_bytes(content)
    items = frames_of(open_source(str(tmp_path)))
    assert isinstance(items[1], LostFrame)
    assert items[1].words == "1.png is damaged: a chunk of the file has a wrong checksum."


def test_an_image_of_another_size_is_damaged(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    save(tmp_path / "1.png", noise(0, (10, 12)))
    items = frames_of(open_source(str(tmp_path)))
    assert isinstance(items[1], LostFrame)
    assert items[1].words == "1.png has 12x10 pixels, but the recording has 40x30."


def test_levels_that_are_no_whole_numbers_are_refused(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    (tmp_path / "1.tif").write_bytes(cv2.imencode(".tif", np.ones((30, 40), np.float32))[1].tobytes())
    items = frames_of(open_source(str(tmp_path)))
    assert isinstance(items[1], LostFrame)
    assert items[1].words == "1.tif must have levels of 8 or 16 bits, but they are float32."


def test_a_stack_in_one_file_is_refused(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    cv2.imwritemulti(str(tmp_path / "1.tif"), [noise(1), noise(2)])
    items = frames_of(open_source(str(tmp_path)))
    assert isinstance(items[1], LostFrame)
    assert items[1].words == "1.tif contains several pictures: save each picture in a separate file."


def test_jpeg_is_lossy_and_png_is_not(tmp_path: Path) -> None:
    save(tmp_path / "0.png", noise(0))
    assert not open_source(str(tmp_path)).description.lossy
    save(tmp_path / "1.jpg", noise(1))
    source = open_source(str(tmp_path))
    assert source.description.lossy
    assert [item.lossy for item in source if isinstance(item, Frame)] == [False, True]


def test_where_there_are_no_images_the_sentence_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match=r"The folder .* must contain images .* but no such image was found"):
        open_source(str(tmp_path))
    with pytest.raises(InputFileError, match=r"The pattern .* must match images .* but no such image was found"):
        open_source(str(tmp_path / "*.png"))
    (tmp_path / "0.png").write_text("no image")
    with pytest.raises(
        InputFileError, match=r"None of the 1 images of .* can be read: 0\.png is damaged, or is not an image"
    ):
        open_source(str(tmp_path))
