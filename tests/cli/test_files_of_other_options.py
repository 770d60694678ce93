"""A file of this program given to the wrong option: what it is and which option takes it is said, before measuring."""

import sys
from pathlib import Path

import pytest

from fingervision.cli import main

SAMPLES = Path(__file__).parents[2] / "sample_frames"
OPENING, GAUGES = SAMPLES / "opening/opening.mp4", SAMPLES / "opening/gauges.toml"
GRIPPER, RECIPE, BED = SAMPLES / "paper/gripper.toml", SAMPLES / "paper_run/recipe.toml", SAMPLES / "paper_run/bed.toml"


@pytest.mark.parametrize(
    ("option", "file", "facts"),
    [
        ("--mechanism", GAUGES, ("gauge file", "--gauges")),
        ("--mechanism", RECIPE, ("recipe", "bed run")),
        ("--mechanism", BED, ("bed", "--bed")),
        ("--gauges", GRIPPER, ("gripper", "--mechanism")),
        ("--gauges", BED, ("bed", "--bed")),
    ],
)
def test_the_sentence_says_what_it_is_and_what_takes_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    option: str,
    file: Path,
    facts: tuple[str, str],
) -> None:
    given = ["measure", str(OPENING), "--px-per-mm", "34", option, str(file), "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["fingervision", *given])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert all(fact in said for fact in (file.name, *facts))
    assert not (tmp_path / "out").exists()
