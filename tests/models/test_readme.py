"""Every Python block in the README of `models` runs without change."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "fingervision" / "models" / "README.md").read_text(), re.DOTALL)


@pytest.mark.parametrize("place", range(len(BLOCKS)))
def test_block(place: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile(BLOCKS[place], f"block {place}", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_there_are_blocks() -> None:
    assert len(BLOCKS) >= 5
