"""`fingervision.measure`: the command's numbers, from any picture; what cannot be meant is refused by name."""

from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UnknownNameError
from fingervision.rendering import Camera, render, two_fingers
from tests.commands import printed
from tests.csv_rows import csv_rows

SAMPLES = Path(__file__).parents[2] / "sample_frames"
TABLE1 = SAMPLES / "table1"
SCALE = 34.0
GAP_MM = 2.0


def picture(noise_grey: float = 2.0) -> np.ndarray:
    scene = two_fingers(GAP_MM * SCALE, below_tip_px=0.3 * SCALE, radius_px=12.0)
    return render(scene, Camera(blur_px=0.9, noise_grey=noise_grey), np.random.default_rng(3))


command = partial(printed, "measure")


def test_saves_the_commands_bytes(tmp_path: Path) -> None:
    calibration = TABLE1 / "calibration.json"
    said = command(str(TABLE1), "--calibration", str(calibration), "--out", str(tmp_path / "command"))
    measured = fv.measure(TABLE1, calibration=calibration)
    assert not list(tmp_path.glob("function*"))
    measured.save(tmp_path / "function", overlay=True, steps=3)
    assert (tmp_path / "function/gaps.csv").read_bytes() == (tmp_path / "command/gaps.csv").read_bytes()
    assert (tmp_path / "function/gap.png").read_bytes() == (tmp_path / "command/gap.png").read_bytes()
    assert said.startswith(measured.report())
    assert sorted(each.name for each in (tmp_path / "function").iterdir()) == [
        "gap.png", "gaps.csv", "overlay.mp4", "steps", "summary.json",
    ]  # fmt: skip
    assert len(list((tmp_path / "function/steps").iterdir())) == 6


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [0.1, None])
def test_joins_a_drive_as_the_command_does(tmp_path: Path, offset_s: float | None) -> None:
    rate_hz, rng = 10.0, np.random.default_rng(8)
    times = np.arange(40) / rate_hz
    inputs = 0.3 * np.sin(2 * np.pi * times / 1.7) + 0.2 * np.sin(2 * np.pi * times / 2.9)
    (tmp_path / "frames").mkdir()
    for index, input_mm in enumerate(inputs):
        scene = two_fingers(SCALE * (2.0 + input_mm), below_tip_px=10.2, radius_px=12.0, frame=(320, 240))
        grey = render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng)
        cv2.imwrite(str(tmp_path / f"frames/{index:03d}.png"), grey)
    log_s = np.arange(0.0, 4.2, 0.02) - 0.1
    drive = {"time_s": log_s, "input_mm": np.interp(log_s + 0.1, times, inputs)}
    lines = [f"{time_s:.4f},{input_mm:.6f}" for time_s, input_mm in zip(*drive.values(), strict=True)]
    (tmp_path / "drive.csv").write_text("\n".join(["time_s,input_mm", *lines]) + "\n")
    options = ["--px-per-mm", "34", "--rate-hz", "10", "--drive", str(tmp_path / "drive.csv")]
    options += [] if offset_s is None else ["--drive-offset-s", str(offset_s)]
    command(str(tmp_path / "frames"), *options, "--out", str(tmp_path / "command"))
    measured = fv.measure(
        tmp_path / "frames", px_per_mm=34, rate_hz=rate_hz, drive=tmp_path / "drive.csv", drive_offset_s=offset_s
    )
    measured.save(tmp_path / "function")
    for name in ("gaps.csv", "gap.png"):
        assert (tmp_path / "function" / name).read_bytes() == (tmp_path / "command" / name).read_bytes()
    assert measured.columns[-2:] == ("run", "input_mm")
    assert measured[5].input_mm == pytest.approx(inputs[5], abs=2e-3)


@pytest.mark.parametrize(
    "form",
    [
        lambda grey: grey,
        lambda grey: grey[:, :, None],
        lambda grey: np.dstack([grey] * 3),
        lambda grey: np.dstack([grey, grey, grey, np.full_like(grey, 255)]),
        lambda grey: grey / 255.0,
        lambda grey: (grey / 255.0).astype(np.float32),
        lambda grey: np.asfortranarray(grey),
        lambda grey: np.stack([grey, grey]),
        lambda grey: np.dstack([grey] * 3)[None],
    ],
)
def test_any_form_of_a_picture_gives_the_same_number(form) -> None:
    grey = picture()
    expected = fv.measure(grey, px_per_mm=SCALE)[0]
    measured = fv.measure(form(grey), px_per_mm=SCALE)
    assert {(row.gap_mm, row.u_random_mm) for row in measured} == {(expected.gap_mm, expected.u_random_mm)}
    assert expected.gap_mm == pytest.approx(GAP_MM, abs=4 * expected.u_random_mm)


@pytest.mark.parametrize(
    "form",
    [
        lambda grey: grey.astype(np.uint16) * 257,
        lambda grey: (grey.astype(np.uint16) * 257).astype(">u2"),
        lambda grey: grey.astype(np.uint16) * 257 / 65535 * 0.999,
        lambda grey: np.flipud(grey)[::-1],
    ],
)
def test_other_depths_agree_within_their_uncertainty(form) -> None:
    grey = picture()
    expected, row = fv.measure(grey, px_per_mm=SCALE)[0], fv.measure(form(grey), px_per_mm=SCALE)[0]
    assert row.gap_mm == pytest.approx(expected.gap_mm, abs=0.2 * expected.u_random_mm)


@pytest.mark.parametrize(
    ("source", "facts"),
    [
        ({"frame": picture()}, "dict"),
        (None, "None"),
        (3.5, "float"),
        (picture().astype(complex), "complex128"),
        (picture() > 100, "true and false"),
        (picture().astype(np.int64), "int64"),
        (picture().astype(str), "<U3"),
        (np.ma.masked_less(picture(), 50), "masked"),
    ],
)
def test_refuses_what_holds_no_levels(source: object, facts: str) -> None:
    with pytest.raises(ArgumentTypeError) as refused:
        fv.measure(source, px_per_mm=SCALE)  # type: ignore[arg-type]
    assert refused.value.argument == "source"
    assert facts in refused.value.found


@pytest.mark.parametrize(
    ("source", "facts"),
    [
        (np.zeros((0, 640), np.uint8), "(0, 640)"),
        (np.zeros(640, np.uint8), "(640,)"),
        (np.zeros((4, 5, 6, 7), np.uint8), "(4, 5, 6, 7)"),
        (picture().astype(float), "0 (black) to 1 (full scale)"),
        (-(picture() / 255.0), "-"),
        (np.where(picture() > 150, np.nan, 0.5), "NaN"),
        (np.dstack([picture()] * 4), "alpha"),
    ],
)
def test_refuses_levels_that_no_camera_has(source: np.ndarray, facts: str) -> None:
    with pytest.raises(ArgumentError) as refused:
        fv.measure(source, px_per_mm=SCALE)
    assert refused.value.argument.startswith("source")
    assert facts in str(refused.value)
    with pytest.raises(ValueError, match="source"):
        fv.measure(source, px_per_mm=SCALE)


def test_refuses_a_data_frame() -> None:
    pandas = pytest.importorskip("pandas")
    with pytest.raises(ArgumentTypeError) as refused:
        fv.measure(pandas.DataFrame(picture()), px_per_mm=SCALE)
    assert "pandas DataFrame of shape (480, 640)" in refused.value.found


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("below_tip_mm", -0.3),
        ("below_tip_mm", "0.3"),
        ("below_tip_mm", float("nan")),
        ("px_per_mm", True),
        ("px_per_mm", 0.0),
        ("roi", (1, 2, 3)),
        ("roi", (0.0, 0.0, 10.0, 10.0)),
        ("roi", (0, 0, 9000, 10)),
        ("bits", 20),
        ("drive_offset_s", float("inf")),
        ("rate_hz", -1.0),
        ("times_s", [1.0, 2.0]),
        ("frames", 3),
        ("coding", "mpeg"),
        ("drive", [1, 2]),
        ("response", 2.2),
        ("calibration", 34.0),
        ("progress", "yes"),
    ],
)
def test_names_the_argument_that_cannot_be_meant(argument: str, value: object) -> None:
    arguments = {"px_per_mm": SCALE, argument: value}
    if argument == "calibration":
        del arguments["px_per_mm"]
    with pytest.raises(fv.UsageError) as refused:
        fv.measure(picture(), **arguments)
    assert argument in str(refused.value)
    assert "--" not in str(refused.value)


def test_tells_the_nearest_word() -> None:
    with pytest.raises(UnknownNameError) as refused:
        fv.measure(picture(), px_per_mm=SCALE, tips="dwon")
    assert (refused.value.argument, refused.value.nearest) == ("tips", "down")


def test_a_frame_without_a_number_says_why() -> None:
    measured = fv.measure(np.full((480, 640), 128, np.uint8), px_per_mm=SCALE)
    assert measured.counts == {"low_contrast": 1}
    assert measured[0].gap_mm is None
    assert "no gap" in repr(measured)
    assert "<img" in measured._repr_html_()


def test_times_of_an_array_reach_the_rows() -> None:
    stack = np.stack([picture()] * 3)
    assert [row.time_s for row in fv.measure(stack, px_per_mm=SCALE, times_s=[0.0, 0.5, 0.7])] == [0.0, 0.5, 0.7]
    assert [row.time_s for row in fv.measure(stack, px_per_mm=SCALE, rate_hz=4.0)] == [0.0, 0.25, 0.5]
    assert fv.measure(stack, px_per_mm=SCALE).time_s is None


def test_a_camera_gives_the_frames_that_are_asked_for() -> None:
    from fingervision.frames.simulated import true_gap_mm

    measured = fv.measure("simulated", frames=3)
    truth = [true_gap_mm(index) for index in range(3)]
    assert np.allclose(measured.gap_mm, truth, atol=4 * measured.u_random_mm.max())
    with pytest.raises(ArgumentError) as refused:
        fv.measure("simulated")
    assert refused.value.argument == "frames"


def test_turns_into_tables() -> None:
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    stack = np.stack([picture(), np.zeros_like(picture())])
    measured = fv.measure(stack, px_per_mm=SCALE, rate_hz=25.0)
    frame = measured.to_dataframe()
    assert tuple(frame.columns) == measured.columns
    assert frame["gap_mm"][1] is pandas.NA
    assert frame["status"].tolist() == ["ok", "low_contrast"]
    data = measured.to_xarray()
    assert isinstance(data, xarray.Dataset)
    assert float(data.gap_mm[0]) == measured[0].gap_mm
    assert data.gap_mm.attrs["units"] == "mm"
    assert data.time_s.values.tolist() == [0.0, 0.04]


def test_the_table_of_pandas_is_that_of_the_file(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    measured = fv.measure(picture(), px_per_mm=SCALE)
    (row,) = csv_rows(measured.save(tmp_path / "out") / "gaps.csv")
    values = measured.to_dataframe().iloc[0]
    assert float(row["gap_mm"]) == pytest.approx(values["gap_mm"], abs=1e-7)
    assert row["status"] == values["status"]


def test_does_not_replace_another_pictures_results(tmp_path: Path) -> None:
    fv.measure(picture(), px_per_mm=SCALE).save(tmp_path / "out")
    fv.measure(picture(), px_per_mm=SCALE).save(tmp_path / "out")
    with pytest.raises(fv.UsageError) as refused:
        fv.measure(picture(3.0), px_per_mm=SCALE).save(tmp_path / "out")
    assert "folder must be a folder of its own" in str(refused.value)


def test_is_drawn_into_given_axes_and_cells() -> None:
    from matplotlib.figure import Figure

    measured = fv.measure(np.stack([picture()] * 4), px_per_mm=SCALE)
    axes = Figure().subplots(2, 1)
    assert measured.plot(tuple(axes)) == tuple(axes)
    assert axes[0].get_ylabel() == "gap (mm)"
    assert measured._repr_html_().count("data:image/png;base64") == 1
    assert measured.picture(2).shape == (480, 640, 3)
    assert "\n" not in repr(measured)
    assert len(repr(measured)) < 120


def test_rows_are_a_sequence() -> None:
    measured = fv.measure(np.stack([picture()] * 3), px_per_mm=SCALE)
    assert (len(measured), len(list(measured)), len(measured[1:]), measured[-1].frame) == (3, 3, 2, 2)
    with pytest.raises(AttributeError):
        measured.rows = ()  # type: ignore[misc]
