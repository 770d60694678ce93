"""Settings in a file: what is saved is what is read, and the commands take it where nothing else is given."""

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from fingervision.cli._options import where_to_measure
from fingervision.domain.errors import DataError
from fingervision.storage.settings_toml import read_settings, write_settings

WHOLE = """schema = 1
calibration = "calibration.json"
below_tip_mm = 0.4
tips = "down"
roi = [1, 2, 300, 200]
fingers = "light"
[camera]
exposure_ms = 8
gain = 0.5
size = "640x480"
"""


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "out" / "settings.toml"
    write_settings(
        path,
        {"calibration": tmp_path / "c.json", "below_tip_mm": 0.4, "tips": "up", "roi": [1, 2, 3, 4], "fingers": "dark",
         "px_per_mm": None, "camera": {"gain": 2.0, "focus": None}},
    )  # fmt: skip
    found = read_settings(path)
    assert found.pop("calibration").resolve() == (tmp_path / "c.json").resolve()
    assert found == {
        "below_tip_mm": 0.4, "tips": "up", "roi": "1,2,3,4", "fingers": "dark", "camera": {"gain": 2.0}
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("", "schema"),
        ("schema = 1\nu_px_per_mm = 0.1", "add px_per_mm"),
        ('schema = 1\npx_per_mm = 34\ncalibration = "c.json"', "both"),
        ("schema = 1\n[camera]\niso = 3", "iso"),
        ("not toml", "TOML"),
        ("\x00", "TOML"),
    ],
)
def test_a_wrong_file_is_refused_with_what_is_wrong(text: str, fact: str, tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=fact):
        read_settings(path)


def taken(*options: str) -> dict[str, object]:
    """What a command that measures is given."""
    found: dict[str, object] = {}

    @click.command()
    @where_to_measure
    def command(**given: object) -> None:
        found.update(given)

    result = CliRunner().invoke(command, options, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return found


def test_the_commands_take_it_and_what_is_given_comes_first(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text(WHOLE)
    options = ("--settings", str(path))
    assert taken(*options) == {
        "calibration": tmp_path / "calibration.json", "px_per_mm": None, "u_px_per_mm": None, "below_tip_mm": 0.4,
        "tips": "down",
        "roi": "1,2,300,200",
    }  # fmt: skip
    given = taken(*options, "--px-per-mm", "12", "--tips", "up")
    assert (given["px_per_mm"], given["calibration"], given["tips"]) == (12.0, None, "up")
    assert taken("--px-per-mm", "12")["below_tip_mm"] == 0.3


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), (20.0, 0.3, None)),
        (("--px-per-mm", "40"), (40.0, None, None)),
        (("--px-per-mm", "40", "--u-px-per-mm", "1"), (40.0, 1.0, None)),
        (("--u-px-per-mm", "1"), (20.0, 1.0, None)),
        (("--calibration", "c.json"), (None, None, Path("c.json"))),
    ],
)
def test_an_uncertainty_belongs_to_the_scale_beside_it(
    tmp_path: Path, options: tuple[str, ...], expected: tuple[object, ...]
) -> None:
    path = tmp_path / "settings.toml"
    path.write_text("schema = 1\npx_per_mm = 20.0\nu_px_per_mm = 0.3\n")
    given = taken("--settings", str(path), *options)
    assert (given["px_per_mm"], given["u_px_per_mm"], given["calibration"]) == expected
