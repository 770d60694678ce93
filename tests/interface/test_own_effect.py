"""An effect of one's own in nine lines: listed, looked up, diagnosed, and gone again."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UnknownNameError
from fingervision.domain.parameter import Estimate
from fingervision.effects import added_effects, catalogue, withdraw
from fingervision.plugins.faults import PluginNameError, PluginShapeError
from fingervision.storage.model_toml import write_model


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = set(catalogue())
    yield
    for name in set(catalogue()) - before:
        withdraw(name)


def bump() -> fv.effects.__class__:
    @fv.effect("mechanism", fv.Parameter("height_mm", "mm", -0.2, 0.2, "height of the bump"))
    def mid_bump(points, history, values):
        """The gap bulges in the middle of the range.

        height_mm exp(-((u - 0.5) / 0.1)^2 / 2)
        """
        bulge = values["height_mm"] * np.exp(-0.5 * ((history.input_mm - 0.5) / 0.1) ** 2)
        return points.with_gap(points.gap_mm + bulge)

    return mid_bump


def test_is_listed_in_its_stages_place() -> None:
    before = len(fv.effects)
    made = bump()
    assert len(fv.effects) == before + 1
    assert fv.effects["mid_bump"] is made or fv.effects["mid_bump"].name == "mid_bump"
    assert "mid_bump" in fv.effects
    assert made.words == "the gap bulges in the middle of the range"
    assert "exp" in made.formula
    stages = [str(effect.stage) for effect in fv.effects]
    assert stages == sorted(stages, key=["drive", "mechanism", "camera"].index)
    assert "mid_bump" in repr(fv.effects)
    assert "mid_bump" in fv.effects._repr_html_()


def test_a_cell_may_run_twice() -> None:
    bump()
    bump()
    assert list(catalogue()).count("mid_bump") == 1


@pytest.mark.slow
def test_is_named_on_a_table_that_hides_it_and_simulates() -> None:
    bump()
    rng = np.random.default_rng(5)
    inputs = np.tile(np.concatenate([np.linspace(0, 1, 60), np.linspace(1, 0, 60)]), 2)
    simulation = {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}
    true_mm = 0.05
    gaps = 1.0 + 2.0 * inputs + true_mm * np.exp(-0.5 * ((inputs - 0.5) / 0.1) ** 2)
    table = {
        "input_mm": inputs,
        "gap_mm": gaps + rng.normal(0, 1e-3, inputs.size),
        "time_s": 0.1 * np.arange(inputs.size),
    }
    found = fv.diagnose(table, simulation)
    assert [effect.name for effect in found.effects] == ["mid_bump"]
    height = found.effects[0].parameters["height_mm"]
    assert height.value == pytest.approx(true_mm, abs=4 * height.u)
    again = fv.simulate(found.corrected_model, [0.0, 0.5, 1.0]).gap_mm
    assert again == pytest.approx([1.0, 2.0 + true_mm, 3.0], abs=2e-3)


def test_effects_of_a_call_are_gone_after_it() -> None:
    made = bump()
    withdraw("mid_bump")
    rng = np.random.default_rng(5)
    inputs = np.linspace(0, 1, 80)
    table = {"input_mm": inputs, "gap_mm": 1 + 2 * inputs + rng.normal(0, 1e-3, 80)}
    found = fv.diagnose(table, {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}, effects=[made])
    assert "mid_bump" not in catalogue()
    assert found.verdict == "agrees"
    assert found.own_effects == (made,)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("wheel", fv.Parameter("x", "mm", 0, 1, "x")), UnknownNameError),
        (("camra", fv.Parameter("x", "mm", 0, 1, "x")), UnknownNameError),
        (("drive", "x"), ArgumentTypeError),
        (("drive", []), ArgumentTypeError),
        (("drive", fv.Parameter("x", "mm", 1, 1, "x")), ArgumentError),
    ],
)
def test_refuses_what_is_no_effect(arguments: tuple, error: type[Exception]) -> None:
    with pytest.raises(error):
        fv.effect(*arguments)


def test_refuses_functions_that_cannot_be_one() -> None:
    size = fv.Parameter("x_mm", "mm", 0, 1, "x")
    with pytest.raises(ArgumentTypeError):
        fv.effect("drive", size)(lambda input_mm: input_mm)
    with pytest.raises(ArgumentError):
        fv.effect("drive", size)(lambda input_mm, history, values: input_mm)
    with pytest.raises(PluginNameError, match="backlash"):

        @fv.effect("drive", size, name="backlash")
        def taken(input_mm, history, values):
            """Take a name."""
            return input_mm

    with pytest.raises(PluginShapeError, match=r"0\.1"):

        @fv.effect("drive", size)
        def never_neutral(input_mm, history, values):
            """Shift the input even if the shift is 0."""
            return input_mm + values["x_mm"] + 0.1

    with pytest.raises(UnknownNameError):
        fv.effect("drive", size, needs_time=True)
    assert "taken" not in catalogue()


def test_looks_up_by_name_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError) as refused:
        fv.effects["backlahs"]
    assert refused.value.nearest == "backlash"
    with pytest.raises(KeyError):
        fv.effects["backlahs"]
    assert replace(fv.effects["backlash"], order=1).order == 1


def test_a_corrected_model_says_where_an_effect_of_ones_own_came_from(tmp_path: Path) -> None:
    """Without the effect the file cannot be read, and the sentence says what it needs."""
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import fingervision as fv\n\n\n"
        "@fv.effect('mechanism', fv.Parameter('height_mm', 'mm', -0.2, 0.2, 'height'))\n"
        "def mid_bump(points, history, values):\n"
        '    """The gap bulges."""\n'
        "    return points.with_gap(points.gap_mm + values['height_mm'])\n"
    )
    (tmp_path / "simulation.csv").write_text("input_mm,gap_mm\n0,1\n1,2\n")
    out = tmp_path / "model.toml"
    with added_effects((mine,)):
        write_model(out, tmp_path / "simulation.csv", {"mid_bump": {"height_mm": Estimate(0.01, 0.001)}})
        assert fv.read_model(out).effects["mid_bump"]["height_mm"].value == 0.01
    assert "mid_bump" not in catalogue()
    with pytest.raises(fv.DataError, match=r"--effects .*mine\.py"):
        fv.read_model(out)
    bump()
    write_model(out, tmp_path / "simulation.csv", {"mid_bump": {"height_mm": Estimate(0.01, 0.001)}})
    withdraw("mid_bump")
    with pytest.raises(fv.DataError, match="@fingervision"):
        fv.read_model(out)
    write_model(out, tmp_path / "simulation.csv", {"backlash": {"play_mm": Estimate(0.01, 0.001)}})
    assert "from =" not in out.read_text()
