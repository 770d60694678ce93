"""The reference names every key that no record declares (the others: test_declared_formats.py); figures are drawn."""

import importlib
import re
import sys
from pathlib import Path

import matplotlib as mpl
import pytest

from fingervision.domain.status import Status
from fingervision.storage import response_csv

ROOT = Path(__file__).parents[2]
FORMATS = (ROOT / "docs" / "reference" / "file_formats.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"[\w.]+", FORMATS))


def keys_in(*paths: str) -> set[str]:
    """Keys of the mappings that a module writes."""
    found: set[str] = set()
    for path in paths:
        found |= set(re.findall(r'"([a-z_0-9]+)": ', (ROOT / path).read_text(encoding="utf-8")))
    return found


@pytest.mark.parametrize(
    ("what", "keys"),
    [
        ("status", {str(status) for status in Status}),
        ("response.csv", set(response_csv.COLUMNS)),
        ("report.json", keys_in("fingervision/storage/summary_json.py")),
        ("calibration.json", keys_in("fingervision/storage/calibration_json.py") - {"tilt", "value", "stated"}),
    ],
)
def test_every_key_stands_in_the_reference(what: str, keys: set[str]) -> None:
    missing = {key for key in keys if key not in NAMED}
    assert not missing, f"docs/reference/file_formats.md says nothing of these keys of {what}: {sorted(missing)}"


def test_every_file_that_a_page_names_is_there() -> None:
    there = {path.name for top in ("fingervision", "calib", "tests", "docs") for path in (ROOT / top).rglob("*.py")}
    written_by_readers = {"bent_screw.py", "my_stage.py"}
    for page in (ROOT / "docs").rglob("*.md"):
        for name in re.findall(r"`([\w/]+\.py)`", page.read_text(encoding="utf-8")):
            assert name.split("/")[-1] in there | written_by_readers, f"{page.name} names {name}, which is not there"
            if name.startswith(("fingervision/", "calib/", "tests/")):
                assert (ROOT / name).exists(), f"{page.name} names {name}, which is elsewhere"


@pytest.mark.parametrize("path", sorted((ROOT / "docs" / "figures").glob("*.svg")), ids=lambda path: path.stem)
def test_a_figure_is_what_its_script_draws(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn_by = re.search(r"Matplotlib v([\d.]+)", path.read_text(encoding="utf-8"))
    assert drawn_by is not None
    if drawn_by[1] != mpl.__version__:
        pytest.skip(f"drawn by Matplotlib {drawn_by[1]}, here is {mpl.__version__}")
    monkeypatch.setattr(sys, "path", [str(ROOT / "docs" / "figures"), *sys.path])
    make = importlib.import_module("make")
    monkeypatch.setattr(make, "SCRIPTS", [path.stem])
    (made,) = make.make(tmp_path)
    # Numbers may differ in their last digits between machines.
    assert _numbers(made) == pytest.approx(_numbers(path), abs=0.01)


def _numbers(path: Path) -> list[float]:
    return [float(number) for number in re.findall(r"(?<![\w#])-?\d+\.\d+", path.read_text(encoding="utf-8"))]
