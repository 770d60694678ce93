"""`fingervision measure` as its user meets it: results, sentences, exit codes, and never a traceback."""

import csv
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from calib.measured_scale import Calibration, Reference, ScalePart
from fingervision.cli import main
from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.calibration_json import write_calibration
from tests.clips import FFV1, h264, write_clip

PX_PER_MM = 20.0
SCALE = ("--px-per-mm", f"{PX_PER_MM:g}")
# A gap at noise 1 and blur 0.9 px, lossless, is good to a few hundredths of a pixel.
GAP_TOLERANCE_MM = 0.05 / PX_PER_MM
# A drop's separation follows the truth with this standard deviation (px): the bars of the project.
LOSSLESS_PX, LOSSY_PX = 0.010, 0.020
ENDLESS = 20_000

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    monkeypatch.chdir(tmp_path)

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fingervision", "measure", *(str(argument) for argument in arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        code = ended.value.code
        return (0 if code is None else int(code)), said.out, said.err

    return command


def gaps_px(count: int) -> list[float]:
    return [60.0 + 2.0 * k for k in range(count)]


def frames(count: int) -> Iterator[Frame]:
    rng = np.random.default_rng(0)
    for k, gap_px in enumerate(gaps_px(count)):
        scene = two_fingers(gap_px, below_tip_px=0.3 * PX_PER_MM, width_px=40.0, frame=(240, 200))
        yield Frame(render(scene, Camera(blur_px=0.9, noise_grey=1.0), rng), k, 0.04 * k)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "opening.mkv"
    write_clip(path, frames(12), FFV1)
    return path


def rows(path: Path) -> list[dict[str, str]]:
    text = path.read_text(encoding="utf-8")
    assert text.endswith("\n")
    return list(csv.DictReader(text.splitlines()))


def test_a_clip_gives_its_gaps(run: Run, clip: Path) -> None:
    code, out, err = run(clip, *SCALE)
    assert (code, err) == (0, "")
    assert "12 of 12 frames measured." in out
    table = rows(Path("measured/opening.mkv/gaps.csv"))
    assert [float(row["gap_mm"]) for row in table] == pytest.approx(
        [gap_px / PX_PER_MM for gap_px in gaps_px(12)], abs=GAP_TOLERANCE_MM
    )
    assert [float(row["time_s"]) for row in table] == pytest.approx([0.04 * k for k in range(12)])
    assert {path.name for path in Path("measured/opening.mkv").iterdir()} == {"gaps.csv", "summary.json", "gap.png"}


def test_json_is_the_summary(run: Run, clip: Path) -> None:
    code, out, _ = run(clip, *SCALE, "--json", "--out", "results")
    assert code == 0
    printed = json.loads(out)
    assert printed == json.loads(Path("results/summary.json").read_text())
    assert printed["scale"]["px_per_mm"] == PX_PER_MM
    assert printed["recording"]["lossy"] is False
    assert printed["gap"]["median_u_gap_mm"] is None
    assert re.fullmatch("[0-9a-f]{64}", printed["recording"]["sha256"])


def test_every_step_of_a_frame_is_a_numbered_picture(run: Run, clip: Path) -> None:
    assert run(clip, *SCALE, "--steps", "3", "--out", "s")[0] == 0
    pictures = sorted(Path("s/steps").iterdir())
    assert [path.name[:3] for path in pictures] == [f"{number:02d}_" for number in range(1, len(pictures) + 1)]
    assert len(pictures) >= 6
    for path in pictures:
        assert cv2.imread(str(path), cv2.IMREAD_UNCHANGED).shape[:2] == (200, 240), path.name


def test_a_lossy_clip_is_advised_to_be_lossless(run: Run, tmp_path: Path) -> None:
    write_clip(tmp_path / "lossy.mp4", frames(2), h264())
    code, out, _ = run(tmp_path / "lossy.mp4", *SCALE)
    assert code == 0
    assert "The recording is compressed with loss (h264)" in out


def calibration(path: Path, frame_size_px: tuple[int, int]) -> Path:
    covariance = np.diag([0.002**2, 0.05**2])
    scale = Calibration(
        px_per_mm=PX_PER_MM,
        edge_bias_px=0.5,
        parts=(ScalePart("scale and edge bias", covariance),),
        frame_size_px=frame_size_px,
        references=(Reference("bar", 5.0, 0.001, "certificate 7", "2026-03-01"),),
    )
    write_calibration(scale, path)
    return path


def test_with_a_calibration_the_uncertainty_is_whole_and_its_artefact_is_named(run: Run, clip: Path) -> None:
    file = calibration(Path("calibration.json"), (240, 200))
    code, out, _ = run(clip, "--calibration", file, "--out", "c", "--json")
    assert code == 0
    for row, gap_px in zip(rows(Path("c/gaps.csv")), gaps_px(12), strict=True):
        # A light gap between dark fingers, so the edge bias is added.
        assert float(row["gap_mm"]) == pytest.approx((gap_px + 0.5) / PX_PER_MM, abs=GAP_TOLERANCE_MM)
        assert float(row["u_gap_mm"]) > float(row["u_random_mm"]) > 0.0
        across_mm = float(row["right_mm"]) - float(row["left_mm"])
        assert across_mm == pytest.approx(float(row["gap_mm"]), abs=GAP_TOLERANCE_MM)
    summary = json.loads(out)
    assert summary["scale"]["reference"][0]["certificate"] == "certificate 7"
    assert summary["gap"]["median_u_gap_mm"] > summary["gap"]["median_u_random_mm"]
    assert summary["uncertainty"]["coverage_factor"] == 2


def test_a_calibration_for_other_frames_is_refused(run: Run, clip: Path) -> None:
    code, _, err = run(clip, "--calibration", calibration(Path("calibration.json"), (640, 480)))
    assert code == 1
    assert "The calibration was made on frames of 640x480 pixels, but these are 240x200: calibrate again" in err


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("CLIP",), 2, "The scale must be given, but is not: add --calibration FILE"),
        (("CLIP", *SCALE, "--calibration", "c.json"), 2, "but both are given: leave out one of them"),
        (("CLIP", "--px-per-mm", "0"), 2, "--px-per-mm must be positive, but is 0."),
        (("CLIP", "--px-per-mm", "-3"), 2, "--px-per-mm must be positive, but is -3."),
        (("CLIP", "--px-per-mm", "nan"), 2, "--px-per-mm must be a number"),
        (("CLIP", "--px-per-mm", "many"), 2, "--px-per-mm must be a number"),
        (("CLIP", *SCALE, "--tips", "sideways"), 2, "is not one of"),
        (("CLIP", *SCALE, "--roi", "200,0,100,50"), 2, "--roi must lie inside the frame of 240x200 pixels"),
        (("CLIP", *SCALE, "--roi", "1,2,3"), 2, "--roi must be four whole numbers X,Y,W,H in pixels, but is '1,2,3'."),
        (("CLIP", *SCALE, "--below-tip-mm", "0"), 2, "--below-tip-mm must be positive, but is 0."),
        (("CLIP", *SCALE, "--rate-hz", "25"), 2, "is a video with its own times: leave --rate-hz out."),
        (("CLIP", *SCALE, "--steps", "-1"), 2, "must be the number of a frame, from 0, but is -1"),
        (("CLIP", *SCALE, "--steps", "99"), 2, "--steps must be the number of a frame that can be read, 0 to 11"),
        (("CLIP", *SCALE, "--drive", "none.csv"), 1, "There is no table none.csv."),
        (("CLIP", "--calibration", "none.json"), 1, "There is no calibration file none.json"),
        (("CLIP", *SCALE, "--out", "taken"), 1, "--out must be a folder, but taken is a file: name another."),
        (("CLIP", *SCALE, "--out", "/proc/nowhere"), 1, "The folder /proc/nowhere cannot be written"),
        (("none.mp4", *SCALE), 1, "There is no recording none.mp4: give a video file"),
        (("empty", *SCALE), 1, "The folder empty must contain images"),
        (("empty/*.png", *SCALE), 1, "The pattern empty/*.png must match images"),
        (("text.mp4", *SCALE), 1, "text.mp4 must be a video, but cannot be read as one"),
        (("nothing.mp4", *SCALE), 1, "nothing.mp4 must be a video, but the file is empty"),
    ],
)
def test_bad_input_ends_in_a_sentence_and_its_code(
    run: Run, clip: Path, arguments: tuple[str, ...], code: int, sentence: str
) -> None:
    Path("empty").mkdir()
    Path("taken").touch()
    Path("nothing.mp4").touch()
    Path("text.mp4").write_text("This is a text.\n" * 50)
    found, _, err = run(*(clip if argument == "CLIP" else argument for argument in arguments))
    assert sentence in err
    assert found == code


def test_results_do_not_go_among_the_images(run: Run, tmp_path: Path) -> None:
    (tmp_path / "images").mkdir()
    for frame in frames(2):
        cv2.imwrite(str(tmp_path / "images" / f"{frame.index}.png"), frame.pixels)
    code, _, err = run("images", *SCALE, "--out", "images")
    assert code == 2
    assert "--out must not be the folder of the recording" in err


def test_an_mp4_without_its_end_cannot_be_opened(run: Run, tmp_path: Path) -> None:
    write_clip(tmp_path / "whole.mp4", frames(4), h264())
    content = (tmp_path / "whole.mp4").read_bytes()
    (tmp_path / "cut.mp4").write_bytes(content[: len(content) // 2])
    code, _, err = run("cut.mp4", *SCALE)
    assert code == 1
    assert "was truncated before its index was written" in err


def test_a_black_recording_has_a_table_and_no_number(run: Run, tmp_path: Path) -> None:
    black = (Frame(np.zeros((100, 120), np.uint8), k, 0.04 * k) for k in range(3))
    write_clip(tmp_path / "black.mkv", black, FFV1)
    code, _, err = run("black.mkv", *SCALE)
    assert code == 1
    assert "None of the 3 frames could be measured (3 low_contrast)." in err
    assert [row["status"] for row in rows(Path("measured/black.mkv/gaps.csv"))] == ["low_contrast"] * 3


def subprocess_of(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "fingervision", "measure", *(str(argument) for argument in arguments)]


def write_endless(path: Path) -> None:
    """A recording of one frame, over and over: long to measure, written in a moment, and small without noise."""
    scene = two_fingers(60.0, below_tip_px=0.3 * PX_PER_MM, width_px=40.0, frame=(240, 200))
    frame = Frame(render(scene, Camera(blur_px=0.9, noise_grey=0.0), np.random.default_rng(0)), 0, 0.0)
    once = path.with_stem("once")
    write_clip(once, [frame], FFV1)
    with av.open(once) as first, av.open(path, "w") as container:
        stream = container.add_stream_from_template(first.streams.video[0])
        stream.time_base = Fraction(1, 1000)
        (picture,) = [bytes(packet) for packet in first.demux(video=0) if packet.size]
        for k in range(ENDLESS):
            packet = av.Packet(picture)
            packet.stream, packet.time_base, packet.pts, packet.dts = stream, Fraction(1, 1000), 40 * k, 40 * k
            packet.is_keyframe = True
            container.mux(packet)


def test_ctrl_c_keeps_what_was_measured(tmp_path: Path) -> None:
    path = tmp_path / "long.mkv"
    write_endless(path)
    out = tmp_path / "out"
    with subprocess.Popen(subprocess_of(path, *SCALE, "--out", out), stderr=subprocess.PIPE, text=True) as process:
        patience_s = 60.0
        # The file is there before its header is.
        while (
            not ((out / "gaps.csv").exists() and (out / "gaps.csv").read_bytes().count(b"\n") > 1) and patience_s > 0.0
        ):
            time.sleep(0.02)
            patience_s -= 0.02
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
    assert process.returncode == 1
    assert re.search(r"Stopped by the user after \d+ frames; what was measured until then is in", err)
    assert "Traceback" not in err
    table = rows(out / "gaps.csv")
    assert 0 < len(table) < ENDLESS
    assert all(row["status"] == "ok" for row in table)
    assert json.loads((out / "summary.json").read_text())["complete"] is False
