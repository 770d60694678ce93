"""`fingervision.calibrate` and `Calibration`: the command's file, from files and arrays; a check; refusals by name."""

import json
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.errors import ArgumentError
from fingervision.interface.examples import board_pictures, micrometer
from tests.commands import printed

FOLDER = Path(__file__).parents[2] / "sample_frames/reference"
SIZES = {"bar_05mm.png": 5.0, "bar_11mm.png": 11.0, "bar_17mm.png": 17.0}
TRUE_PX_PER_MM = 34.0


command = partial(printed, "calibrate")


def content(path: Path) -> dict[str, object]:
    document = json.loads(path.read_text())
    document.pop("made_at")
    return document


def array(name: str) -> np.ndarray:
    picture = cv2.imread(str(FOLDER / name), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return picture


def test_saves_the_commands_calibration(tmp_path: Path) -> None:
    items = [f"{FOLDER / name}={size}" for name, size in SIZES.items()]
    said = command("bar", *items, f"slot:{FOLDER / 'slot_03mm.png'}=3.0", "-o", tmp_path / "command.json")
    sizes = {FOLDER / name: size for name, size in SIZES.items()} | {f"slot:{FOLDER / 'slot_03mm.png'}": 3.0}
    made = fv.calibrate("bar", sizes)
    made.save(tmp_path / "function.json", pictures=True)
    assert content(tmp_path / "function.json") == content(tmp_path / "command.json")
    assert said.startswith(made.report())
    for name in ("bar_05mm", "slot_03mm"):
        pictures = [(tmp_path / f"{side}_{name}.png").read_bytes() for side in ("function", "command")]
        assert pictures[0] == pictures[1]
    assert made.px_per_mm == pytest.approx(TRUE_PX_PER_MM, abs=2 * made.u_px_per_mm)
    assert len(repr(made)) < 120
    assert "<img" in made._repr_html_()


def test_arrays_are_the_files_that_they_were_read_from() -> None:
    of_files = fv.calibrate("bar", [(FOLDER / name, size) for name, size in SIZES.items()])
    of_arrays = fv.calibrate("bar", [(array(name), size, "bar") for name, size in SIZES.items()])
    assert of_arrays.px_per_mm == of_files.px_per_mm
    assert of_arrays.u_px_per_mm == of_files.u_px_per_mm


def test_a_loaded_calibration_measures_and_checks() -> None:
    calibration = fv.Calibration.load(FOLDER / "calibration.json")
    (checked,) = calibration.check({FOLDER / "bar_08mm.png": 8.0})
    assert checked.agrees
    assert checked.measured_mm == pytest.approx(8.0, abs=2 * checked.u_measured_mm)
    (wrong,) = calibration.check([(array("bar_08mm.png"), 8.2)])
    assert not wrong.agrees
    table1 = FOLDER.parent / "table1"
    by_object = fv.measure(table1 / "frame_05.png", calibration=calibration)
    by_file = fv.measure(table1 / "frame_05.png", calibration=FOLDER / "calibration.json")
    assert by_object.u_gap_mm == by_file.u_gap_mm
    assert by_object.summary["scale"] == by_file.summary["scale"]


@pytest.mark.slow
def test_boards_and_line_scales(tmp_path: Path) -> None:
    board_pictures(tmp_path)
    micrometer(tmp_path)
    tilted = sorted(tmp_path.glob("tilted*.png"))
    board = fv.calibrate("chessboard", [tmp_path / "plane.png", *tilted], squares=(9, 6), square_mm=2.5)
    assert board.px_per_mm == pytest.approx(20.0, abs=2 * board.u_px_per_mm)
    options = ("--squares", "9x6", "--square-mm", 2.5, "-o", tmp_path / "command.json")
    command("chessboard", tmp_path / "plane.png", *tilted, *options)
    assert content(board.save(tmp_path / "function.json")) == content(tmp_path / "command.json")
    charuco = sorted(tmp_path.glob("charuco_*.png"))
    board = fv.calibrate("charuco", charuco, squares=(8, 6), square_mm=3.0, marker_mm=2.2)
    assert board.px_per_mm == pytest.approx(64.0 / 3.0, abs=2 * board.u_px_per_mm)
    lines = fv.calibrate("scale", tmp_path / "micrometer.png", pitch_mm=0.1)
    assert lines.px_per_mm == pytest.approx(340.0, abs=2 * lines.u_px_per_mm)


def test_replaces_a_calibration_and_nothing_else(tmp_path: Path) -> None:
    calibration = fv.Calibration.load(FOLDER / "calibration.json")
    calibration.save(tmp_path / "c.json")
    calibration.save(tmp_path / "c.json")
    (tmp_path / "mine.json").write_text("{}")
    with pytest.raises(fv.FingervisionError):
        calibration.save(tmp_path / "mine.json")
    assert (tmp_path / "mine.json").read_text() == "{}"


@pytest.mark.parametrize(
    ("arguments", "options", "argument"),
    [
        (("bars", {}), {}, "kind"),
        (("bar", {}), {}, "pictures"),
        (("bar", "ref5.png"), {}, "pictures"),
        (("bar", ["ref5.png"]), {}, "pictures"),
        (("bar", {FOLDER / "bar_05mm.png": -5.0}), {}, "pictures"),
        (("bar", {FOLDER / "bar_05mm.png": "5"}), {}, "pictures"),
        (("bar", [(None, 5.0)]), {}, "pictures"),
        (("bar", [(np.zeros((4, 5), complex), 5.0)]), {}, "pictures"),
        (("bar", [(np.zeros((3, 40, 50), np.uint8), 5.0)]), {}, "pictures"),
        (("bar", [(FOLDER / "bar_05mm.png", 5.0, "slat")]), {}, "pictures"),
        (("bar", {FOLDER / "bar_05mm.png": 5.0}), {"u_size_mm": "1"}, "u_size_mm"),
        (("bar", {FOLDER / "bar_05mm.png": 5.0}), {"roi": (1, 2)}, "roi"),
        (("bar", {FOLDER / "bar_05mm.png": 5.0}), {"plane_mm": "wide"}, "plane_mm"),
        (("chessboard", [FOLDER / "bar_05mm.png"]), {"square_mm": 1.0}, "squares"),
        (("chessboard", [FOLDER / "bar_05mm.png"]), {"squares": (9, 6)}, "square_mm"),
        (("chessboard", []), {"squares": (9, 6), "square_mm": 1.0}, "pictures"),
        (("chessboard", [FOLDER / "bar_05mm.png"]), {"squares": "9x6", "square_mm": 1.0}, "squares"),
        (("scale", FOLDER / "bar_05mm.png"), {}, "pitch_mm"),
        (("bar", {"nowhere.png": 5.0}), {}, "nowhere.png"),
    ],
)
def test_names_what_cannot_be_meant(arguments: tuple, options: dict, argument: str) -> None:
    with pytest.raises(fv.FingervisionError) as refused:
        fv.calibrate(*arguments, **options)
    assert argument in str(refused.value)
    if isinstance(refused.value, ArgumentError):
        assert refused.value.argument.startswith(argument)
    assert "--" not in str(refused.value)


@pytest.mark.parametrize("size", ["5", True, 0.0, [5000]])
def test_a_size_that_is_none_is_named_with_its_picture(size: object) -> None:
    with pytest.raises(ArgumentError, match="size") as refused:
        fv.calibrate("bar", {FOLDER / "bar_05mm.png": size})
    assert "bar_05mm.png" in str(refused.value)


def test_sizes_in_another_unit_show_in_what_the_picture_would_show() -> None:
    sizes = {"bar_05mm.png": 5.0, "bar_11mm.png": 11.0}
    for factor, shown in ((1.0, "18.8 x 14.1 mm"), (1e3, "18.8 x 14.1 m\n"), (1e-3, "18.8 x 14.1 µm")):
        found = fv.calibrate("bar", {FOLDER / name: factor * size for name, size in sizes.items()})
        assert shown in found.report()
        assert " 0.00000 px/mm" not in found.report()


def test_what_shows_no_reference_is_said() -> None:
    with pytest.raises(fv.FingervisionError):
        fv.calibrate("bar", [(np.full((480, 640), 128, np.uint8), 5.0)])
    with pytest.raises(fv.FingervisionError):
        fv.Calibration.load("nowhere.json")
