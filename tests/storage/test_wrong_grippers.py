"""Wrong drawings: each is refused in one sentence that names the number, and leaves nothing like a result."""

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import DataError
from fingervision.storage.gripper_toml import gripper_from_tables

REFERENCE = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"
INCH = 1.0 / 25.4

# What is wrong, and what its sentence must name.
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"body.plate_mm": 3000.0}, "body.plate_mm"),
    ({"hinge.web_mm": 20.0}, "hinge.web_mm"),
    # Another unit.
    ({"material.youngs_modulus_mpa": 1.65}, "GPa"),
    ({"material.youngs_modulus_mpa": 1.65e9}, "Pa"),
    ({"material.yield_mpa": 48e6}, "material.yield_mpa"),
    ({"material.yield_mpa": 0.048}, "material.yield_mpa"),
    ({"hinge.thickness_mm": 0.04 * INCH, "hinge.radius_mm": 4.0 * INCH}, "hinge.radius_mm"),
    ({"body.height_mm": 0.1}, "metres"),
    ({"body.rest_gap_mm": 0.004}, "body.rest_gap_mm"),
    ({"lever.l2_mm": 17.82 * INCH}, "(l2, l1)"),
    ({"lever.hinge1_axis_deg": math.pi / 2}, "lever.hinge1_axis_deg"),
    ({"body.width_mm": 80.0 * INCH}, "body.width_mm"),
    # Swapped.
    ({"hinge.thickness_mm": 4.0, "hinge.radius_mm": 1.0}, "hole"),
    ({"hinge.thickness_mm": 9.0, "hinge.web_mm": 1.0}, "hinge.thickness_mm"),
    ({"body.width_mm": 100.0, "body.height_mm": 80.0}, "body."),
    ({"lever.hinge1_axis_deg": 47.7, "lever.hinge2_axis_deg": 90.0}, "axis_deg"),
    ({"links.pillar_and_root_mm": [40.0, 31.0, 0.0, 45.0]}, "links.pillar_and_root_mm"),
    ({"links.pillar_and_root_mm": [0.0, 45.0, 31.0, 40.0]}, "hinge"),
    ({"links.finger_mm": [39.0, 25.1, 88.0, 9.5]}, "finger_mm"),
    ({"links.shuttle_to_mm": [40.35, 27.1]}, "hinge2"),
    # Unjoined, overlapping, crossing themselves, outside.
    ({"links.finger_mm": [60.0, 70.0, 50.0, 88.0]}, "pieces"),
    ({"links.cross_bar_mm": [40.0, 60.0, 22.1, 60.0]}, "pieces"),
    ({"links.tip_polygon_mm": [[2, 120], [2, 112], [6, 110], [15, 114], [9, 120]]}, "pieces"),
    ({"links.tip_polygon_mm": [[2, 100], [9, 100], [2, 92], [15, 84]]}, "links.tip_polygon_mm"),
    ({"links.drive_block_mm": [10.0, 14.0, 2.57, 5.57]}, ""),
    ({"lever.drive_face_y_mm": 30.0}, "lever.drive_face_y_mm"),
    ({"body.measured_below_tip_mm": 30.0}, "body.measured_below_tip_mm"),
    ({"body.rest_gap_mm": 8.0}, "body.rest_gap_mm"),
    ({"lever.hinge1_mm": [35.5, 42.0], "lever.l1_mm": 12.0}, "inge 1"),
    ({"lever.hinge1_mm": [35.5, -5.0], "lever.l1_mm": -35.0}, "hinge1_mm"),
    ({"lever.hinge1_mm": [60.0, 30.0], "lever.l2_mm": 42.32}, "hinge1_mm"),
    ({"lever.hinge1_mm": [30.2, 30.0], "lever.l2_mm": 12.52}, "hinge1_mm"),
    ({"hinge.radius_mm": 1.0}, "hole"),
    ({"hinge.radius_mm": 2.0, "hinge.thickness_mm": 0.4}, "hole"),
    ({"lever.hinge1_axis_deg": 0.0}, "lever.hinge1_axis_deg"),
    ({"lever.hinge2_axis_deg": -47.7}, "lever.hinge2_axis_deg"),
    ({"lever.drive_mm": [5.0, 10.57]}, "lever.drive_mm"),
    ({"links.shuttle_from_mm": [0.0, 20.0]}, "links.shuttle_from_mm"),
    ({"links.tip_polygon_mm": [[2, 100], [2, 92]]}, "links.tip_polygon_mm"),
    ({"hinge.thickness_mm": {"value": math.nan, "u": 0.1}}, "hinge.thickness_mm"),
    ({"hinge.thickness_mm": {"value": 1.0, "u": math.inf}}, "hinge.thickness_mm"),
]


def drawing(changes: dict[str, Any]) -> dict[str, Any]:
    given = copy.deepcopy(tomllib.loads(REFERENCE.read_text()))
    for name, value in changes.items():
        section, key = name.split(".")
        given[section][key] = value
    return given


@pytest.mark.parametrize(("changes", "named"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_wrong_drawing_is_one_sentence(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(DataError) as refused:
        gripper_from_tables(drawing(changes), "g.toml")
    sentence = str(refused.value)
    assert named in sentence
    assert "g.toml" in sentence
    assert "\n" not in sentence
    assert "must" in sentence


def test_nothing_is_written_for_a_wrong_drawing(tmp_path: Path) -> None:
    wrong = tmp_path / "g.toml"
    wrong.write_text(REFERENCE.read_text().replace("radius_mm = 4.0", "radius_mm = 1.0"))
    with pytest.raises(DataError):
        CliRunner().invoke(command, [str(wrong), "--out", str(tmp_path / "o")], catch_exceptions=False)
    assert not (tmp_path / "o").exists()
