"""A stage from a file: a note names its contract test if it is missing, and a run reports a stage that ignores the
requested speed.
"""

import re
import shlex
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fingervision.cli import cli
from fingervision.testbed.clocks.clock import VirtualClock

ROOT = Path(__file__).parents[2]
TUTORIAL = (ROOT / "docs" / "tutorials" / "own_stage.md").read_text(encoding="utf-8")
RECIPE = 'schema = 1\n[[step]]\nkind = "triangle"\nfrom_mm = -0.2\nto_mm = 0.4\nspeed_mm_s = 1.0\n'
KEEPS_SPEED = "done_mm = min(abs(way_mm), self._speed_mm_s * max(0.0, time_s - self._began_s))"


def called(folder: Path, *words: str) -> Result:
    found = [str(folder / "recipe.toml"), "--bed", str(folder / "bench.toml")]
    return CliRunner().invoke(cli, ["bed", words[0], *found, *words[1:]], catch_exceptions=False)


@pytest.fixture(params=["", "too_fast", "too_slow"])
def bench(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, str]:
    """The stage of the tutorial with its test bed, one that is there at once, and one of a quarter of its speed.

    Stage and bed share a virtual clock, so that nobody waits for a motion.
    """
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: VirtualClock(begin_s=100.0))
    stage, bed = (
        re.search(rf"```\w+\n(# {name}\n.*?)```", TUTORIAL, re.DOTALL)[1]  # type: ignore[index]
        for name in ("my_stage.py", "bench.toml")
    )
    assert KEEPS_SPEED in stage
    if request.param == "too_slow":
        stage = stage.replace(
            "self._speed_mm_s, self._began_s = speed_mm_s", "self._speed_mm_s, self._began_s = 0.25 * speed_mm_s"
        )
    if request.param == "too_fast":
        stage = stage.replace(KEEPS_SPEED, "done_mm = abs(way_mm)")
        stage = stage.replace("self._began_s + way_mm / self._speed_mm_s", "self._began_s")
    (tmp_path / "my_stage.py").write_text(stage, encoding="utf-8")
    (tmp_path / "bench.toml").write_text(bed, encoding="utf-8")
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    return tmp_path, request.param


@pytest.mark.parametrize("bench", ["", "too_fast"], indirect=True)
def test_the_line_that_bed_check_prints_tests_the_contract(bench: tuple[Path, str]) -> None:
    folder, fault = bench
    (line,) = re.findall(r"python -c .*", called(folder, "check").output)
    *_, program = shlex.split(line)
    printed = StringIO()
    with redirect_stdout(printed):
        exec(program, {})
    assert ("keeps the contract" in printed.getvalue()) is not bool(fault)
    assert ("test_a_motion_takes_the_time_that_its_speed_says" in printed.getvalue()) is bool(fault)


def test_a_run_tells_of_a_stage_that_does_not_keep_its_speed(bench: tuple[Path, str]) -> None:
    folder, fault = bench
    done = called(folder, "run", "--out", str(folder / "run"))
    assert ("warning: the recorded motions took" in done.output) is bool(fault)
    events = (folder / "run" / "events.jsonl").read_text(encoding="utf-8")
    assert [each for each in ("too_fast", "too_slow") if each in events] == ([fault] if fault else [])


def test_a_bed_of_built_in_parts_needs_no_contract(tmp_path: Path) -> None:
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    done = CliRunner().invoke(cli, ["bed", "check", str(tmp_path / "recipe.toml")], catch_exceptions=False)
    assert "contract" not in done.output
