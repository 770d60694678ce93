from pathlib import Path
from typing import Any

import pytest

from fingervision.domain.errors import DataError, ModelError
from fingervision.models.uncertainty import mechanism_uncertainty
from fingervision.storage.drawing_numbers import bare_tables, changed_tables
from fingervision.storage.mechanism_toml import read_drawing

FOUR_BAR = Path(__file__).parents[2] / "fingervision" / "models" / "mechanisms" / "four_bar_gripper.toml"
TABLES: dict[str, Any] = {
    "plate_mm": "plate",
    "lengths": {"plate": {"value": 0.8, "u": 0.01}, "t": {"value": "plate / 2", "u": 0.02}},
    "flexure": [{"name": "left", "thickness_mm": "t"}, {"thickness_mm": {"value": 0.5, "u": 0.0}}],
}


def drawn(tmp_path: Path, **changes: str) -> Path:
    text = FOUR_BAR.read_text()
    for name, value in changes.items():
        before = next(line for line in text.splitlines() if line.startswith(f"{name} = "))
        text = text.replace(before, f"{name} = {value}")
    (tmp_path / "m.toml").write_text(text)
    return tmp_path / "m.toml"


def test_uncertain_numbers_are_taken_apart_and_changed() -> None:
    bare, u = bare_tables(TABLES, "m.toml")
    assert u == {"lengths.plate": 0.01, "lengths.t": 0.02}
    assert bare["lengths"] == {"plate": 0.8, "t": "plate / 2"}
    changed = changed_tables(bare, {"lengths.t": -0.1, "flexure.2.thickness_mm": 0.1}, "m.toml")
    assert changed["lengths"]["t"] == "(plate / 2) + (-0.1)"
    assert changed["flexure"][1]["thickness_mm"] == pytest.approx(0.6)
    assert changed_tables(bare, {"flexure.left.thickness_mm": 0.3}, "m.toml", absolute=True)["flexure"][0] == {
        "name": "left",
        "thickness_mm": 0.3,
    }
    assert bare["lengths"]["t"] == "plate / 2"
    with pytest.raises(DataError, match=r"no number called lengths.x in m.toml. .* flexure"):
        changed_tables(bare, {"lengths.x": 1.0}, "m.toml")


def test_a_leafs_thickness_counts_three_times(tmp_path: Path) -> None:
    """24 E I / L^3: three times the thickness's relative uncertainty, once the modulus's."""
    path = drawn(tmp_path, t="{ value = 0.8, u = 0.008 }", youngs_modulus_mpa="{ value = 2200.0, u = 22.0 }")
    drawing = read_drawing(path)
    assert drawing.estimates["lengths.t"].value == 0.8
    found = mechanism_uncertainty(drawing.mechanism, drawing.estimates)["input_stiffness_n_mm"]
    assert found.u / found.value == pytest.approx((0.03**2 + 0.01**2) ** 0.5, rel=0.03)
    assert [name for name, _ in found.shares] == ["lengths.t", "material.youngs_modulus_mpa"]
    assert not found.sampled


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("{ value = 0.8, u = -0.1 }", "The uncertainty of lengths.t in .* must be a number that is not negative"),
        ("{ value = 0.8, u = nan }", "The uncertainty of lengths.t in"),
        ('{ value = 0.8, u = "1 %" }', "The uncertainty of lengths.t in"),
        ("{ value = [0.8, 1.0], u = 0.1 }", "can be given for a single number only"),
    ],
)
def test_a_wrong_uncertainty_is_one_sentence(tmp_path: Path, value: str, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        read_drawing(drawn(tmp_path, t=value)).mechanism()


def test_other_keys_beside_value_and_u_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"lengths.t in .* must be a number"):
        read_drawing(drawn(tmp_path, t="{ value = 0.8, sigma = 0.1 }")).mechanism()


def test_an_uncertainty_that_leaves_no_mechanism_is_refused(tmp_path: Path) -> None:
    drawing = read_drawing(drawn(tmp_path, t="{ value = 0.8, u = 0.9 }"))
    with pytest.raises(ModelError, match=r"The uncertainty of lengths.t is too large"):
        mechanism_uncertainty(drawing.mechanism, drawing.estimates)
