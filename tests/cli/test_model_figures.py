"""Figures of `fingervision model` for a paper, and requests that are refused before anything is computed."""

from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result

from fingervision.cli._model_figures import FigureStyle, extent_mm
from fingervision.cli.model import command
from fingervision.models.finite_element import MechanismPlate
from tests.drawings import drawing

DRAWING = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.3, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
[[body]]
box_mm = [0, 15, 0, 10]
[[body]]
box_mm = [15, 40, 0, 10]
[[flexure]]
kind = "circular"
at_mm = [20, 5]
axis_deg = 0
thickness_mm = 2.0
radius_mm = 8.0
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
box_mm = [40, 40, 0, 10]
direction = [0, 1]
across = "free"
"""
PROBES = """
[[probe]]
name = "a"
at_mm = [2, 5]
[[probe]]
name = "b"
at_mm = [38, 5]
[[pair]]
name = "gap"
of = ["a", "b"]
"""


def model(folder: Path, text: str, *options: str) -> Result:
    (folder / "mechanism.toml").write_text(text)
    return CliRunner().invoke(command, [str(folder / "mechanism.toml"), "--out", str(folder / "out"), *options])


@pytest.mark.slow
def test_every_figure_is_written_as_a_vector_too(tmp_path: Path) -> None:
    asked = (
        "--kind",
        "finite_element",
        "--frequency",
        "10:100",
        "--vector",
        "--magnify",
        "3",
        "--colour",
        "displacement",
    )
    done = model(tmp_path, DRAWING + PROBES, *asked)
    assert done.exit_code == 0, done.output
    pictures = sorted(path.stem for path in (tmp_path / "out").glob("*.png"))
    assert pictures == ["deformed", "frequency", "models"]
    for ending in ("svg", "pdf"):
        assert sorted(path.stem for path in (tmp_path / "out").glob(f"*.{ending}")) == pictures
    again = model(tmp_path, DRAWING + PROBES, "--kind", "finite_element")
    assert again.exit_code == 0, again.output
    assert not list((tmp_path / "out").glob("*.svg"))


def test_the_deformed_shape_is_magnified_by_the_stated_factor(tmp_path: Path) -> None:
    plate = MechanismPlate(drawing(tmp_path, DRAWING))
    moved = plate.state(1.0).displacement_mm
    high = [extent_mm(plate.plate, moved)[1][1]]
    with click.Context(command) as context:
        context.params = {"magnify": 5.0}
        assert FigureStyle.asked() == FigureStyle(5.0)
        high.append(extent_mm(plate.plate, moved)[1][1])
    assert high[1] - 10.0 == pytest.approx(5.0 * (high[0] - 10.0))
    assert np.isclose(high[0], 11.0, atol=0.2)


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (DRAWING + PROBES, ("--kind", "lumped", "--object-mm", "30")),
        (DRAWING, ("--kind", "lumped", "--frequency", "10:100")),
        (DRAWING + PROBES, ("--kind", "stiffness_matrix", "--modes", "2")),
        (DRAWING, ("--magnify", "0")),
    ],
)
def test_what_cannot_be_answered_is_refused_before_the_computing(
    text: str, options: tuple[str, ...], tmp_path: Path
) -> None:
    done = model(tmp_path, text, *options)
    assert done.exit_code != 0
    assert not (tmp_path / "out" / "models.csv").exists()


@pytest.mark.slow
def test_a_convergence_table_shows_the_limit_of_fine_meshes(tmp_path: Path) -> None:
    done = model(tmp_path, DRAWING + PROBES, "--convergence")
    assert done.exit_code == 0, done.output
    table = np.genfromtxt(tmp_path / "out" / "convergence.csv", delimiter=",", names=True)
    assert np.all(np.diff(table["triangles"]) > 0)
    stiffness = table["input_stiffness_n_mm"]
    # Displacement elements are too stiff, the less the finer they are.
    assert np.all(np.diff(stiffness) < 1e-4 * stiffness[0])
    assert stiffness[-1] == pytest.approx(stiffness[-2], rel=2e-3)
