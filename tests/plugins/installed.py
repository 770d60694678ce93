"""A distribution that is installed without an installer: its metadata and modules in a folder on the path."""

from pathlib import Path
from textwrap import dedent

import pytest

EFFECT = """
import numpy as np
from fingervision.domain.effect import DriveEffect, Stage
from fingervision.domain.parameter import Parameter

def act(input_mm, history, values):
    return input_mm + values["bend_per_mm2"] * input_mm**3

EFFECT = DriveEffect(
    name="NAME", stage=Stage.DRIVE, words="the screw bends", formula="u + bend_per_mm2 u^3", source="made up",
    residual="a cubic over the input",
    parameters=(Parameter("bend_per_mm2", "1/mm2", -0.1, 0.1, "bend"),), act=act,
)
"""


def effect_source(name: str = "screw_bend") -> str:
    return EFFECT.replace("NAME", name)


def install(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    points: dict[str, dict[str, str]],
    modules: dict[str, str],
    *,
    name: str = "fv-demo",
    requires: str = "fingervision",
) -> None:
    """Put a distribution on the import path.

    Parameters
    ----------
    points : dict of str to dict of str to str
        Entry points: by group, the object of each name.
    modules : dict of str to str
        Source of each module.
    """
    place = folder / name
    info = place / f"{name.replace('-', '_')}-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\nRequires-Dist: {requires}\n")
    lines = [
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in of.items()) for group, of in points.items()
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    for module, source in modules.items():
        (place / f"{module}.py").write_text(dedent(source))
    monkeypatch.syspath_prepend(str(place))
