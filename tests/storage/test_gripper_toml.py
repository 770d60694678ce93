import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from fingervision.domain.errors import DataError, InputFileError
from fingervision.storage.gripper_toml import gripper_from_tables, read_gripper

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "sample_frames" / "paper" / "gripper.toml"


def tables(**changes: Any) -> dict[str, Any]:
    given = copy.deepcopy(tomllib.loads(REFERENCE.read_text()))
    for name, value in changes.items():
        section, key = name.split("__")
        given[section][key] = value
    return given


@pytest.mark.parametrize("path", [REFERENCE, ROOT / "fingervision" / "models" / "micro_gripper.toml"])
def test_both_drawings_are_read(path: Path) -> None:
    assert read_gripper(path).measuring_point_mm[0] == pytest.approx(read_gripper(path).body.rest_gap_mm / 2.0)


def test_an_uncertainty_may_stand_beside_a_number() -> None:
    gripper = gripper_from_tables(tables(hinge__thickness_mm={"value": 1.0, "u": 0.1}), "g")
    assert gripper.hinge.thickness_mm == 1.0
    assert dict(gripper.uncertainties) == {"hinge.thickness_mm": 0.1}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"hinge__thickness_mm": 10.0}, "must be smaller than the web that the notches cut, 9 mm, but is 10"),
        (
            {"hinge__radius_mm": 2.0, "hinge__thickness_mm": 0.4},
            "must open through the faces of its link, but the disc",
        ),
        ({"lever__l2_mm": 18.0}, "lever.hinge2_mm in g must lie at hinge 1 less (l2, l1) = (17.5, 30), but lies at"),
        ({"lever__drive_mm": [1.0, 10.57]}, "mm away: the links do not meet"),
        ({"body__rest_gap_mm": 5.0}, "must lie at half of body.rest_gap_mm, 2.5 mm, but lies at 2 mm"),
        ({"body__height_mm": 0.1}, "but is 0.1; are its lengths in metres?"),
        (
            {"links__shuttle_to_mm": [0.0, 10.57]},
            "must end beside and above the bar's beginning at (0, 10.57), but ends",
        ),
        (
            {"links__drive_block_mm": [7.0, 0.0, 2.57, 18.57]},
            "each range from the smaller to the larger number, but is [7, 0, 2.57, 18.57].",
        ),
        ({"links__tip_polygon_mm": [[2.0, 100.0]] * 3}, "must be different points, but one of them occurs twice"),
        ({"links__tip_polygon_mm": [[2.0, 100.0], [6.0, 80.0], [9.0, 100.0]]}, "must have a vertical inner face"),
        ({"hinge__radius_mm": {"value": 4.0}}, "must be a number or {value = ..., u = ...}, but has the keys value."),
        ({"hinge__radius_mm": {"value": 4.0, "u": -1.0}}, "hinge.radius_mm.u in g must be at least 0, but is -1"),
    ],
)
def test_what_cannot_be_a_gripper_is_refused_in_a_sentence(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(DataError) as refused:
        gripper_from_tables(tables(**changes), "g")
    assert sentence in str(refused.value)


def test_missing_parts_are_named() -> None:
    whole = tables()
    del whole["material"]
    with pytest.raises(DataError, match=r"must have a section \[material\], but has none"):
        gripper_from_tables(whole, "g")
    whole = tables()
    del whole["body"]["plate_mm"]
    with pytest.raises(DataError, match=r"\[body\] in .* must state plate_mm, but does not"):
        gripper_from_tables(whole, "g")
    whole = tables()
    whole["hinges"] = {}
    with pytest.raises(DataError, match=r"hinges in .* is not known: did you mean hinge"):
        gripper_from_tables(whole, "g")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="There is no drawing"):
        read_gripper(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("[hinge")
    with pytest.raises(DataError, match="must be TOML, but is not"):
        read_gripper(tmp_path / "bad.toml")
