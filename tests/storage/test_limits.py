"""Sizes and values that no bench has are refused in a sentence, before anything is made of them."""

import os
import re
import struct
import zlib
from pathlib import Path

import pytest

from fingervision.domain.errors import DataError, OutputError
from fingervision.effects import catalogue
from fingervision.frames.image_file import PNG_SIGNATURE, UnreadableImageError, read_image
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.measured_table import MOST_RUNS, read_measured_table
from fingervision.storage.model_toml import read_model, write_model
from fingervision.storage.recipe_toml import read_recipe, write_recipe
from fingervision.storage.settings_toml import write_settings

SIMULATION = "input_mm,gap_mm\n0,1\n1,2\n"


def model(folder: Path, parameters: str, name: str = "backlash") -> Path:
    (folder / "simulation.csv").write_text(SIMULATION)
    path = folder / "model.toml"
    lines = ["schema = 1", 'base = "simulation.csv"', "[[effect]]", f'name = "{name}"', "[effect.parameters]"]
    path.write_text("\n".join([*lines, parameters, ""]))
    return path


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "-1.0", "1e9", "1" * 400])
def test_a_parameter_outside_its_bounds_is_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(DataError, match="play_mm"):
        read_model(model(tmp_path, f"play_mm = {{ value = {value}, u = 0.001 }}"))


@pytest.mark.parametrize("u", ["nan", "inf", "-1.0"])
def test_an_uncertainty_that_is_none_is_refused(tmp_path: Path, u: str) -> None:
    with pytest.raises(DataError, match=r"play_mm\.u in line 5"):
        read_model(model(tmp_path, f"play_mm = {{ value = 0.01, u = {u} }}"))


def test_the_bounds_themselves_are_taken(tmp_path: Path) -> None:
    for name, effect in catalogue().items():
        for end in ("lower", "upper"):
            values = [f"{each.name} = {{ value = {getattr(each, end)!r} }}" for each in effect.parameters]
            assert name in read_model(model(tmp_path, "\n".join(values), name)).effects


@pytest.mark.parametrize(
    "effect", ["effect = 3", "effect = [3]", "effect = ['backlash']", "[effect]\nname = 'backlash'"]
)
def test_what_is_no_effect_is_a_sentence(tmp_path: Path, effect: str) -> None:
    (tmp_path / "simulation.csv").write_text(SIMULATION)
    (tmp_path / "model.toml").write_text(f"schema = 1\nbase = 'simulation.csv'\n{effect}\n")
    with pytest.raises(DataError, match="effect"):
        read_model(tmp_path / "model.toml")


def test_a_model_that_names_itself_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text("schema = 1\nbase = 'other.toml'\n")
    (tmp_path / "other.toml").write_text("schema = 1\nbase = 'model.toml'\n")
    with pytest.raises(DataError, match="is the file itself or a model based on it"):
        read_model(tmp_path / "model.toml")


def test_a_byte_order_mark_is_no_fault(tmp_path: Path) -> None:
    path = model(tmp_path, "play_mm = { value = 0.01 }")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert read_model(path).effects["backlash"]["play_mm"].value == 0.01


def test_a_column_that_numbers_the_rows_is_no_run(tmp_path: Path) -> None:
    rows = [f"{k % 7},{k % 5},{k}" for k in range(MOST_RUNS + 1)]
    (tmp_path / "table.csv").write_text("\n".join(["input_mm,gap_mm,run", *rows]))
    with pytest.raises(DataError, match=f"at most {MOST_RUNS} runs, but has {MOST_RUNS + 1}"):
        read_measured_table(tmp_path / "table.csv")


def test_a_picture_that_states_more_pixels_than_any_camera_has_is_never_decoded(tmp_path: Path) -> None:
    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", 50_000, 50_000, 8, 0, 0, 0, 0)
    png = PNG_SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    jpeg = b"\xff\xd8\xff\xc0" + struct.pack(">HBHHB", 11, 8, 60_000, 60_000, 1) + b"\x01\x11\x00\xff\xd9"
    for name, content in (("big.png", png), ("big.jpg", jpeg)):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(UnreadableImageError, match="million"):
            read_image(tmp_path / name)


@pytest.mark.parametrize("number", ["9" * 400, "9" * 5000, "[" * 3000], ids=["400 digits", "5000 digits", "brackets"])
def test_a_number_without_end_is_a_sentence_in_every_document(tmp_path: Path, number: str) -> None:
    top = Path(__file__).parents[2] / "sample_frames"
    for name, read, key in (
        ("paper/gripper.toml", read_gripper, re.compile(r"(_mm = )[\d.]+")),
        ("opening/calibration.json", read_calibration, re.compile(r'("px_per_mm": )[\d.]+')),
    ):
        path = tmp_path / Path(name).name
        path.write_text(key.sub(rf"\g<1>{number}", (top / name).read_text(encoding="utf-8"), count=1), encoding="utf-8")
        with pytest.raises(DataError):
            read(path)
    with pytest.raises(DataError):
        read_model(model(tmp_path, f"play_mm = {{ value = {number} }}"))


def test_a_recipes_name_may_hold_quotes(tmp_path: Path) -> None:
    step = {"kind": "move", "to_mm": 0.3, "speed_mm_s": 0.5}
    write_recipe(tmp_path / "recipe.toml", 'two "speeds" \\ one', [step])
    assert read_recipe(tmp_path / "recipe.toml").name == 'two "speeds" \\ one'


def test_a_recipe_holds_no_negative_zero(tmp_path: Path) -> None:
    step = {"kind": "triangle", "from_mm": -0.0, "to_mm": 0.3, "speed_mm_s": 0.5, "cycles": 2}
    write_recipe(tmp_path / "recipe.toml", "zero", [step])
    text = (tmp_path / "recipe.toml").read_text(encoding="utf-8")
    assert "from_mm = 0.0\n" in text
    assert "cycles = 2\n" in text


@pytest.mark.parametrize("name", ['it\'s "one".csv', "two\nlines.csv", "narrow\u202fspace.csv", "back\\slash.csv"])
def test_a_corrected_model_names_a_base_of_any_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(SIMULATION)
    write_model(tmp_path / "model.toml", tmp_path / name, {})
    assert read_model(tmp_path / "model.toml").base_path == str(tmp_path / name)


def test_a_name_that_is_not_utf8_is_a_sentence(tmp_path: Path) -> None:
    name = os.fsdecode(b"caf\xe9.csv")
    with pytest.raises(OutputError, match=r"caf\\udce9\.csv"):
        write_model(tmp_path / "model.toml", tmp_path / name, {})
    with pytest.raises(OutputError, match=r"caf\\udce9\.csv"):
        write_settings(tmp_path / "settings.toml", {"calibration": tmp_path / name})
    assert not any(tmp_path.iterdir())
