import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from fingervision.domain.errors import DataError
from fingervision.storage.gripper_toml import gripper_from_tables

TABLES = tomllib.loads((Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml").read_text())


def drawn(**material: Any) -> Any:
    tables = copy.deepcopy(TABLES)
    tables["material"] |= material
    return gripper_from_tables(tables, "g.toml").material


def test_an_sn_line_and_an_expansion_are_read() -> None:
    line = {"cycles": [1e3, 1e6], "amplitude_mpa": [20.0, 8.0], "stress_ratio": 0.0}
    material = drawn(sn_line=line, thermal_expansion_per_k=1e-4)
    assert material.sn_line.amplitude_mpa == (20.0, 8.0)
    assert material.thermal_expansion_per_k == 1e-4
    assert drawn().sn_line is None


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (5.0, "material.sn_line in g.toml must be a table"),
        ({"cycles": [1e6, 1e3], "amplitude_mpa": [20.0, 8.0]}, "must fall as the number of cycles rises"),
        ({"cycles": [1e3, 1e6], "amplitude_mpa": [8.0, 20.0]}, "must fall as the number of cycles rises"),
        (
            {"cycles": [1e3, 1e6], "amplitude_mpa": [60.0, 8.0]},
            "must stay below the yield stress, 48 MPa",
        ),
        ({"cycles": [1e3, 1e6], "amplitude_mpa": [30.0, 8.0], "stress_ratio": 0.0}, "but reaches 60 MPa"),
    ],
)
def test_a_wrong_sn_line_is_one_sentence(line: Any, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        drawn(sn_line=line)
