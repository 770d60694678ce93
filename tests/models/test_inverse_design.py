"""Dimensions for wanted figures, against closed forms and by finite elements of the drawing found."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import ModelError, UsageError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.parameter_sweep import Unknown, parse_unknown, parse_wanted, solve_dimensions
from fingervision.storage.mechanism_toml import read_drawing

STAGE = """
plate_mm = 2.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.3, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
[lengths]
t = 1.0
[[body]]
name = "foot"
box_mm = [0, 10, 0, 10]
[[body]]
name = "lever"
box_mm = [20, 40, 0, 10]
[[flexure]]
name = "leaf"
kind = "leaf"
at_mm = [15, 5]
axis_deg = 0
thickness_mm = "t"
half_length_mm = 6.0
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
pin_mm = [30, 5, 2]
direction = [0, 1]
across = "free"
"""


def beam(values: Mapping[str, float]) -> dict[str, float]:
    """Stiffness and first frequency of a strip, by powers of its thickness and length."""
    t, length = values.get("t", 1.0), values.get("l", 10.0)
    return {"stiffness [N/mm]": 5e3 * t**3 / length**3, "mode_hz": 1e4 * t / length**2}


def biased(values: Mapping[str, float]) -> dict[str, float]:
    """The same with errors of a simpler model that depend on the dimensions."""
    t = values.get("t", 1.0)
    return {name: value * (0.9 + 0.03 * t) for name, value in beam(values).items()}


def test_one_and_two_numbers_meet_their_figures_although_the_fast_model_is_wrong() -> None:
    one = solve_dimensions([Unknown("t", 0.5, 2.0)], {"stiffness [N/mm]": 12.0}, biased, beam)
    assert one.values["t"] == pytest.approx((12.0 / 5.0) ** (1 / 3), rel=3e-4)
    assert one.drawn["stiffness [N/mm]"] == pytest.approx(5.0)
    two = solve_dimensions(
        [Unknown("t", 0.5, 2.0), Unknown("l", 5.0, 20.0)], {"stiffness [N/mm]": 8.0, "mode_hz": 100.0}, biased, beam
    )
    found = beam(two.values)
    assert found["stiffness [N/mm]"] == pytest.approx(8.0, rel=1e-3)
    assert found["mode_hz"] == pytest.approx(100.0, rel=1e-3)


def test_what_cannot_be_met_is_refused_with_the_nearest() -> None:
    with pytest.raises(ModelError, match=r"must be within reach of t from 0.5 to 1.2, but the nearest is .* = 8\.6"):
        solve_dimensions([Unknown("t", 0.5, 1.2)], {"stiffness [N/mm]": 12.0}, biased, beam)
    with pytest.raises(UsageError, match="As many --solve as --for"):
        solve_dimensions([Unknown("t", 0.5, 1.2)], {}, biased, beam)


def test_names_and_bounds() -> None:
    assert parse_unknown("t", lambda _: 1.5) == Unknown("t", 0.75, 3.0)
    assert parse_unknown("t=1:2", lambda _: 1.5) == Unknown("t", 1.0, 2.0)
    for text, drawn in (("t=2:1", 1.5), ("t=a:b", 1.5), ("t", 0.0), ("t=2:3", 1.5)):
        with pytest.raises(UsageError):
            parse_unknown(text, lambda _, drawn=drawn: drawn)
    figures = {"gap: per input [mm/mm]": 7.0}
    assert parse_wanted(["gap per_input=8"], figures) == {"gap: per input [mm/mm]": 8.0}
    with pytest.raises(UsageError, match="must name a figure"):
        parse_wanted(["gape=8"], figures)
    with pytest.raises(UsageError, match="not zero"):
        parse_wanted(["gap per input=0"], figures)


@pytest.mark.slow
def test_the_command_finds_a_thickness(tmp_path: Path) -> None:
    path = tmp_path / "mechanism.toml"
    path.write_text(STAGE)
    arguments = [
        str(path),
        "--solve",
        "lengths.t=0.8:1.4",
        "--for",
        "input_stiffness_n_mm=0.12",
        "--out",
        str(tmp_path),
    ]
    said = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert said.exit_code == 0, said.output
    rows = dict(line.split(",", 1) for line in (tmp_path / "solve.csv").read_text().splitlines())
    found = float(rows["lengths.t"].split(",")[1])
    again = MechanismPlate(read_drawing(path).mechanism({"lengths.t": found}, absolute=True))
    assert again.stiffness_n_mm == pytest.approx(0.12, rel=1e-3)
    assert "peak_stress_mpa_per_mm" in said.output
