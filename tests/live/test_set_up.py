"""The set-up panel of the page: findings, indicators, measuring height by dragging, polarity, settings."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from calib.calibration import BareScale
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.frames.source import Wish
from fingervision.live.choices import Choices
from fingervision.live.commands import obey, section
from fingervision.live.opening import opened
from fingervision.live.session import Session
from fingervision.storage.settings_toml import read_settings
from tests.waiting import until


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    monkeypatch.chdir(tmp_path)
    found = Session(opened("simulated", Wish()), Choices(scale=BareScale(34.0)), tmp_path / "out")
    found.start()
    until(lambda: found.history.count >= 3)
    yield found
    found.stop()


@pytest.mark.slow
def test_the_set_up_is_judged_while_measuring_goes_on(session: Session) -> None:
    obey(session, {"do": "inspect"})
    with pytest.raises(FingervisionError, match="already"):
        obey(session, {"do": "inspect"})
    until(lambda: not section(session)["set_up"]["busy"])
    told = section(session)["set_up"]
    assert told["findings"], told["words"]
    assert {"good", "fair", "poor"} >= {each["severity"] for each in told["findings"]}
    assert all(each["remedy"] or each["severity"] == "good" for each in told["findings"])
    assert session.capture.overflowed == 0
    meters = section(session)["meters"]
    # The simulated gripper is drawn with a blur of 0.9 px, beside the pixel's own width of 0.29.
    assert meters["blur_px"] == pytest.approx((0.9**2 + 1 / 12) ** 0.5, abs=0.1)
    assert 0.5 < meters["light"] < 1.0


def test_height_polarity_and_settings(session: Session, tmp_path: Path) -> None:
    seen = session.seen
    assert seen is not None
    tip_px = seen.outcome.left.tip_px  # type: ignore[union-attr]
    obey(session, {"do": "height_at", "x": 320, "y": tip_px + 0.5 * 34.0})
    assert session.choices.below_tip_mm == pytest.approx(0.5, abs=0.03)
    with pytest.raises(UsageError, match="beyond their tips"):
        obey(session, {"do": "height_at", "x": 320, "y": tip_px - 30.0})
    for request in ({"do": "height_at"}, {"do": "fingers", "fingers": "green"}, {"do": "fingers"}):
        with pytest.raises(UsageError):
            obey(session, request)
    obey(session, {"do": "fingers", "fingers": "dark"})
    obey(session, {"do": "tips", "tips": "up"})
    obey(session, {"do": "region", "box": [10, 20, 600, 440]})
    obey(session, {"do": "save_settings"})
    found = read_settings(tmp_path / "out" / "settings.toml")
    assert found == {
        "px_per_mm": 34.0,
        "below_tip_mm": session.choices.below_tip_mm,
        "tips": "up",
        "roi": "10,20,600,440",
        "fingers": "dark",
    }
    kept = session.choices
    obey(session, {"do": "fingers", "fingers": "auto"})
    obey(session, {"do": "region", "box": None})
    obey(session, {"do": "load_settings", "path": "out/settings.toml"})
    assert session.choices == kept
    for path in ("/etc/passwd", "missing.toml", "", 5):
        with pytest.raises((UsageError, FingervisionError)):
            obey(session, {"do": "load_settings", "path": path})
    # A file that could well be read, were it not outside.
    outside = tmp_path.parent / f"{tmp_path.name}_settings.toml"
    outside.write_bytes((tmp_path / "out" / "settings.toml").read_bytes())
    for path in (str(outside), f"../{outside.name}"):
        with pytest.raises(UsageError, match="must lie inside"):
            obey(session, {"do": "load_settings", "path": path})
    assert session.choices == kept
