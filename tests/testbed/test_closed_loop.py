"""Effects added to the simulated test bed are identified from its frames; more cases are in
tests/benchmarks/closed_loop.py.
"""

from pathlib import Path

import pytest

from fingervision.demonstration.demonstrate import demonstrated, drawn
from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.testbed.simulation.injected_effects import Hidden
from tests.commands import printed
from tests.testbed.simulated_beds import run, steps

# One run to the end of the range and back, and one at another speed after a new reference: 400 frames.
RECIPE = steps(
    'kind = "triangle"\nfrom_mm = -0.3\nto_mm = 1.1\nspeed_mm_s = 0.5',
    'kind = "rezero"',
    'kind = "triangle"\nfrom_mm = -0.3\nto_mm = 1.1\nspeed_mm_s = 0.3',
)
# The position of the stage and the gap are each known within 1 um of gap, and hence a play of 0.1 mm within 1 %.
PART_OF_SIZE = 0.01


def answer(folder: Path, hidden: Hidden) -> DiagnosisReport:
    run(folder, RECIPE, hidden)
    table = read_measured_table(folder / "run" / "samples.csv")
    return diagnose(table, read_model(folder / "run" / "simulation.csv")).report


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parameter", "size"), [("backlash", "play_mm", 0.08), ("lens_distortion", "k_per_mm2", 0.001)]
)
def test_what_is_hidden_is_named_with_its_size(tmp_path: Path, name: str, parameter: str, size: float) -> None:
    report = answer(tmp_path, Hidden({name: {parameter: size}}))
    assert report.verdict is Verdict.NAMED
    (effect,) = report.effects
    assert effect.name == name
    assert effect.parameters[parameter].value == pytest.approx(size, rel=PART_OF_SIZE)


@pytest.mark.slow
def test_where_nothing_is_hidden_it_agrees(tmp_path: Path) -> None:
    assert answer(tmp_path, Hidden()).verdict is Verdict.AGREES


@pytest.mark.slow
def test_the_demonstration_finds_what_it_hid_and_says_each_step(tmp_path: Path) -> None:
    said = printed("demo", "--hide", "backlash:play_mm=0.12", "--out", str(tmp_path / "demo"))
    lines = said.splitlines()
    assert "named: The model lacks backlash (full width of the play 0.1" in said
    assert "Hidden effect: backlash (play_mm = 0.12). It was found after one run." in lines
    page = Path(lines[-1].removeprefix("Report: "))
    assert "backlash" in page.read_text(encoding="utf-8")


def test_a_seed_hides_one_effect_of_those_that_can_be_shown() -> None:
    chosen = {name for seed in range(60) for name in drawn(seed).effects}
    assert chosen <= set(demonstrated())
    assert len(chosen) > len(demonstrated()) // 2
    assert drawn(3) == drawn(3)
