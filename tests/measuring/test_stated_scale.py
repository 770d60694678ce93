"""A scale stated with its uncertainty, which contributes to the gap's uncertainty like that of a calibration."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from calib.calibration import STATED, BareScale, StatedScale, is_stated
from fingervision.cli import main
from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Frame
from fingervision.live.choices import Choices
from fingervision.live.playback.track import arguments_of
from fingervision.measuring.scale import stated_scale
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.calibration_json import read_calibration, write_calibration
from fingervision.storage.settings_toml import read_settings, write_settings
from tests.clips import FFV1, write_clip
from tests.csv_rows import csv_rows

PX_PER_MM, U_PX_PER_MM = 20.0, 0.3
SIZE_PX = (240, 200)
FAR_LIMITS_PX = 0.6
"""Edge bias of both edges that nobody measured: half-width."""


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "clip.mkv"
    rng = np.random.default_rng(0)
    scenes = [two_fingers(60.0 + k, below_tip_px=6.0, width_px=40.0, frame=SIZE_PX) for k in range(2)]
    write_clip(path, (Frame(render(each, Camera(), rng), k, 0.04 * k) for k, each in enumerate(scenes)), FFV1)
    return path


def test_its_share_is_the_relative_uncertainty_of_the_gap_added_in_quadrature(clip: Path) -> None:
    bare, small, large = (
        fv.measure(clip, px_per_mm=PX_PER_MM, u_px_per_mm=u)[0] for u in (None, U_PX_PER_MM, 2.0 * U_PX_PER_MM)
    )
    assert bare.u_gap_mm is None
    assert small.u_gap_mm is not None
    assert large.u_gap_mm is not None
    assert small.gap_mm == large.gap_mm == bare.gap_mm
    share_mm = U_PX_PER_MM / PX_PER_MM * bare.gap_mm
    assert large.u_gap_mm**2 - small.u_gap_mm**2 == pytest.approx(3.0 * share_mm**2, rel=1e-6)
    # The edge bias is as unknown as with a single reference, the camera's response is assumed, and the fingers need
    # not lie where the ruler lay.
    assert small.u_shift_px is not None
    least_mm = np.hypot(share_mm, np.hypot(FAR_LIMITS_PX / np.sqrt(3.0), small.u_shift_px) / PX_PER_MM)
    assert least_mm < small.u_gap_mm < 1.1 * least_mm
    assert small.u_random_mm == pytest.approx(bare.u_random_mm)


def test_budget_and_summary_say_what_was_stated(clip: Path) -> None:
    measured = fv.measure(clip, px_per_mm=PX_PER_MM, u_px_per_mm=U_PX_PER_MM)
    share_mm = U_PX_PER_MM / PX_PER_MM * measured[0].gap_mm
    (line,) = (line for line in measured.budget.lines if line.source == STATED)
    assert float(line.u_mm[0]) == pytest.approx(share_mm, rel=0.02)
    scale = measured.summary["scale"]
    assert (scale["kind"], scale["px_per_mm"], scale["u_px_per_mm"]) == ("stated", PX_PER_MM, U_PX_PER_MM)
    assert any("20 px/mm with u = 0.3 px/mm" in words for words in measured.summary["uncertainty"]["covers"])


def test_the_command_writes_it(clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ("measure", str(clip), "--px-per-mm", "20", "--u-px-per-mm", "0.3", "--out", str(tmp_path / "out"))
    monkeypatch.setattr(sys, "argv", ["fingervision", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    rows = csv_rows(tmp_path / "out" / "gaps.csv")
    assert all(float(row["u_gap_mm"]) > 0.3 / 20.0 * float(row["gap_mm"]) for row in rows)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["scale"]["u_px_per_mm"] == 0.3


@pytest.mark.parametrize("u", [0.0, -1.0, 20.0, float("nan"), float("inf")])
def test_an_impossible_uncertainty_is_refused(u: float) -> None:
    with pytest.raises(UsageError, match="--u-px-per-mm must be positive and smaller"):
        stated_scale(PX_PER_MM, u)
    with pytest.raises(ValueError, match="u_px_per_mm"):
        StatedScale(PX_PER_MM, u)


def test_an_uncertainty_without_its_scale_is_refused(clip: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no scale is given"):
        fv.measure(clip, u_px_per_mm=0.3)
    with pytest.raises(UsageError, match="belongs to px_per_mm"):
        fv.measure(clip, calibration=tmp_path / "calibration.json", u_px_per_mm=0.3)


def test_settings_and_the_playback_keep_it(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    write_settings(path, {"px_per_mm": PX_PER_MM, "u_px_per_mm": U_PX_PER_MM})
    found = read_settings(path)
    scale = stated_scale(found["px_per_mm"], found["u_px_per_mm"])
    assert isinstance(scale, StatedScale)
    given = arguments_of("clip.mkv", Choices(scale.for_frames(SIZE_PX)), ())
    assert given[given.index("--u-px-per-mm") + 1] == repr(U_PX_PER_MM)
    assert "--u-px-per-mm" not in arguments_of("clip.mkv", Choices(BareScale(PX_PER_MM)), ())


def test_as_a_file_it_is_the_same_scale(tmp_path: Path) -> None:
    scale = StatedScale(PX_PER_MM, U_PX_PER_MM).for_frames(SIZE_PX)
    write_calibration(scale, tmp_path / "calibration.json")
    again = read_calibration(tmp_path / "calibration.json")
    assert is_stated(again)
    points = np.array([[[80.0, 100.0], [150.0, 100.0]]])
    u_mm = [each.distances(points, np.array([0.02]), np.array([True])).u_mm for each in (scale, again)]
    assert u_mm[0] == pytest.approx(u_mm[1])
    assert again.response_shift_px == 0.0


def test_a_scale_that_is_wrong_by_a_thousand_is_said_by_what_the_picture_would_show(clip: Path) -> None:
    found = fv.measure(clip, px_per_mm=PX_PER_MM / 1e3)
    assert "12 x 10 m" in found.report()
    assert "12 x 10 m" not in fv.measure(clip, px_per_mm=PX_PER_MM).report()
    with pytest.raises(UsageError, match="12 x 10 µm"):
        fv.measure(clip, px_per_mm=PX_PER_MM * 1e3)
