"""fingervision inspect: what it prints, what it writes, and bad input in a sentence."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from fingervision.cli.inspect import command
from fingervision.domain.errors import FingervisionError, UsageError
from tests.benchmarks.faulty_setups.bench import Bench, recorded


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    for k, picture in enumerate(recorded(Bench(), 3, np.random.default_rng(1)).pictures):
        assert cv2.imwrite(str(folder / f"{k}.png"), picture)
    return folder


def test_text_picture_and_json(frames: Path, tmp_path: Path) -> None:
    picture = tmp_path / "seen.png"
    result = run(frames, "--rate-hz", "25", "--px-per-mm", "34", "--picture", picture)
    assert result.exit_code == 0, result.output
    assert "Nothing to mend" in result.output
    assert cv2.imread(str(picture)).shape[1] > 800
    content = json.loads(run(frames, "--px-per-mm", "34", "--no-picture", "--json").output)
    assert content["nothing_to_mend"]
    assert content["worst"] is None
    assert content["picture"] is None
    assert {"name", "severity", "figure", "cost_um", "cost_px", "remedy", "formula"} <= set(content["findings"][0])


def test_without_a_scale_costs_are_in_pixels(frames: Path) -> None:
    content = json.loads(run(frames, "--no-picture", "--json").output)
    assert content["px_per_mm"] is None
    assert all(finding["cost_um"] is None for finding in content["findings"])


def test_no_fingers_is_exit_1_with_the_remedy(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.full((200, 200), 128, dtype=np.uint8))
    result = run(tmp_path, "--px-per-mm", "34", "--no-picture")
    assert result.exit_code == 1
    assert "exposure" in result.output
    assert "no number" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--seconds", "0"), "seconds"),
        (("--seconds", "nan"), "seconds"),
        (("--px-per-mm", "-3"), "positive"),
        (("--px-per-mm", "34", "--calibration", "c.json"), "leave out one of them"),
        (("--px-per-mm", "34", "--roi", "0,0,9999,10"), "inside the frame"),
        (("--px-per-mm", "34", "--below-tip-mm", "0"), "below"),
        (("--px-per-mm", "34", "--response", "nothing.csv"), "response"),
    ],
)
def test_bad_options(frames: Path, arguments: tuple[str, ...], words: str) -> None:
    result = run(frames, "--no-picture", *arguments)
    assert isinstance(result.exception, UsageError), result.output
    assert words in str(result.exception)


def test_bad_sources_and_places(frames: Path, tmp_path: Path) -> None:
    for source in (tmp_path / "missing.mp4", tmp_path):
        assert isinstance(run(source, "--px-per-mm", "34", "--no-picture").exception, FingervisionError)
    result = run(frames, "--px-per-mm", "34", "--picture", tmp_path / "no" / "such" / "folder.png")
    assert isinstance(result.exception, FingervisionError)
