"""Effects hidden in pictures: a film is rendered, `measure --drive` reads it, `diagnose` names what it shows."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from math import cos, hypot, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingervision.cli import main
from fingervision.rendering import RadialLens, Tilt
from tests.end_to_end.film import FRAME, PLAIN, PX_PER_MM, Array, Film, shoot

SAMPLE = Path(__file__).parents[2] / "sample_frames" / "opening"
SEED = 3
SIGMAS = 4.0
"""Estimates lie within four standard uncertainties but once in 16 000 times."""
PLAY_MM = 0.02
FLOOR_MM, REMAINING = 1.4, 0.05
K1 = -0.01
TILT_DEG, DISTANCE_MM = 6.0, 100.0
LATE_S = 0.06
HALF_DIAGONAL_MM = hypot(*FRAME) / 2.0 / PX_PER_MM
FORM_SHARE = 0.02
"""The catalogue's lens and keystone act on the row alone; the picture's act on the outline, whose edges lean."""

Through = Callable[..., dict[str, Any]]
Diagnosed = Callable[..., dict[str, Any]]


def behind_play(input_mm: Array) -> Array:
    """Follow the input by no more than half the play."""
    at, out = float(input_mm[0]), []
    for driven in input_mm.tolist():
        at = min(max(at, driven - PLAY_MM / 2), driven + PLAY_MM / 2)
        out.append(at)
    return np.array(out)


def meeting(gap_mm: Array) -> Array:
    """Soft tips: past the floor, a small share of the closing goes on."""
    return np.where(gap_mm < FLOOR_MM, FLOOR_MM - REMAINING * (FLOOR_MM - gap_mm), gap_mm)


@pytest.fixture
def through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Through:
    """Send a folder's recording through the two commands, beside its drive and its simulation."""

    def run(*arguments: object) -> None:
        monkeypatch.setattr(sys, "argv", ["fingervision", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code in (None, 0)

    def command(folder: Path, recording: str, px_per_mm: float, *clock: object) -> dict[str, Any]:
        measured, diagnosis = tmp_path / "measured", tmp_path / "diagnosis"
        drive, model = folder / "drive.csv", folder / "simulation.csv"
        run("measure", folder / recording, "--px-per-mm", px_per_mm, "--drive", drive, "--out", measured, *clock)
        run("diagnose", measured / "gaps.csv", "--model", model, "--out", diagnosis)
        report: dict[str, Any] = json.loads((diagnosis / "report.json").read_text())
        return report

    return command


@pytest.fixture
def diagnosed(tmp_path: Path, through: Through) -> Diagnosed:
    """Shoot a film, and send it through the two commands."""

    def command(film: Film, *clock: object, px_per_mm: float = PX_PER_MM) -> dict[str, Any]:
        shoot(film, tmp_path, SEED)
        return through(tmp_path, "film.mkv", px_per_mm, *clock)

    return command


def parameter(report: dict[str, Any], name: str) -> tuple[float, float]:
    """Value and standard uncertainty of a parameter of the only effect."""
    assert len(report["effects"]) == 1
    found = report["effects"][0]["parameters"][name]
    return found["value"], found["u"]


@pytest.mark.slow
def test_nothing_hidden_agrees(diagnosed: Diagnosed) -> None:
    assert diagnosed(Film())["verdict"] == "agrees"


@pytest.mark.slow
def test_play_is_named(diagnosed: Diagnosed) -> None:
    report = diagnosed(Film(received=behind_play))
    assert (report["verdict"], report["alternatives"]) == ("named", [["backlash"]])
    play_mm, u = parameter(report, "play_mm")
    assert abs(play_mm - PLAY_MM) < SIGMAS * u


@pytest.mark.slow
def test_the_play_of_the_sample_clip_is_named(through: Through) -> None:
    """A lossy clip (H.264), one run, edges that lean: sample_frames/opening, whose drive has 0.03 mm of play."""
    report = through(SAMPLE, "opening.mp4", 34.0)
    assert (report["verdict"], report["alternatives"]) == ("named", [["backlash"]])
    play_mm, u = parameter(report, "play_mm")
    assert abs(play_mm - 0.03) < SIGMAS * u


@pytest.mark.slow
def test_contact_is_named(diagnosed: Diagnosed) -> None:
    report = diagnosed(Film(gap=meeting))
    assert (report["verdict"], report["alternatives"]) == ("named", [["finger_contact"]])
    floor_mm, u = parameter(report, "floor_mm")
    assert abs(floor_mm - FLOOR_MM) < SIGMAS * u


@pytest.mark.slow
def test_a_barrel_lens_is_named(diagnosed: Diagnosed) -> None:
    report = diagnosed(Film(camera=replace(PLAIN, lens=RadialLens(k1=K1))))
    assert (report["verdict"], report["alternatives"]) == ("named", [["lens_distortion"]])
    k, u = parameter(report, "k_per_mm2")
    true = K1 / HALF_DIAGONAL_MM**2
    assert abs(k - true) < SIGMAS * u + FORM_SHARE * abs(true)


@pytest.mark.slow
def test_a_tilted_camera_is_named(diagnosed: Diagnosed) -> None:
    tilt = Tilt(about_y_deg=TILT_DEG, distance_px=DISTANCE_MM * PX_PER_MM)
    # The scale is the one that a reference in the middle of the same picture has.
    report = diagnosed(Film(camera=replace(PLAIN, tilt=tilt)), px_per_mm=PX_PER_MM * cos(radians(TILT_DEG)))
    assert (report["verdict"], report["alternatives"]) == ("named", [["camera_tilt"]])
    k, u = parameter(report, "k_per_mm")
    true = sin(radians(TILT_DEG)) / DISTANCE_MM
    assert abs(k - true) < SIGMAS * u + FORM_SHARE * true


@pytest.mark.slow
def test_late_frames_are_the_cameras_or_the_drives(diagnosed: Diagnosed) -> None:
    """A late picture of a quick gripper is the picture of a late gripper: nothing in it tells the two apart."""
    report = diagnosed(Film(late_s=LATE_S), "--drive-offset-s", 0)
    assert report["verdict"] == "ambiguous"
    assert sorted(report["alternatives"]) == [["camera_latency"], ["drive_lag"]]
    delay_s, u = parameter(report, "delay_s")
    assert abs(delay_s - LATE_S) < SIGMAS * u
