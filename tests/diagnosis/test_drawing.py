"""A drawing compared with measurements of a changed gripper: the change is named, uncertain dimensions are refitted."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from fingervision.diagnosis.compare import compare
from fingervision.domain.errors import DataError
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model, write_model
from tests.benchmarks.own_physics import CASES, DRAWING, answered, table

Diagnosed = Callable[[str, bool], tuple[DiagnosisReport, Path]]
SIGMAS = 4.0
"""Estimates lie within four standard uncertainties but once in 16 000 times."""
NOISE_SHARE = 1.15
"""Largest ratio of the residual to the noise of an edge: with 400 samples it is known to 4 %; offsets of runs add 10
%."""
EDGE_MM = 0.001


def uncertain(folder: Path, **numbers: float) -> Path:
    """Write the drawing with uncertainties of some of its dimensions."""
    text = DRAWING.read_text(encoding="utf-8")
    for name, u in numbers.items():
        text, found = re.subn(rf"^{name} = ([-0-9.]+)", rf"{name} = {{value = \1, u = {u}}}", text, flags=re.MULTILINE)
        assert found == 1
    path = folder / "gripper.toml"
    path.write_text(text, encoding="utf-8")
    return path


def names(report: DiagnosisReport) -> list[str]:
    return [effect.name for effect in report.effects]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    """Function that diagnoses each case once; it returns the report and the folder with the table."""

    @cache
    def run(case: str, force: bool) -> tuple[DiagnosisReport, Path]:
        folder = tmp_path_factory.mktemp("case")
        return answered(CASES[case], folder, force=force), folder

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "force"),
    [
        ("link", True),
        ("contact", False),
        ("large rotation", False),
        ("right half", False),
        ("hinges", True),
        ("out of plane", False),
    ],
)
def test_what_was_changed_is_named(diagnosed: Diagnosed, case: str, force: bool) -> None:
    report, _ = diagnosed(case, force)
    assert report.verdict is Verdict.NAMED, report.sentence
    assert names(report) == [CASES[case].effect]
    assert report.disagreement.after_rms_mm < NOISE_SHARE * EDGE_MM


@pytest.mark.parametrize("case", ["link", pytest.param("hinges", marks=pytest.mark.slow)])
def test_thinner_hinges_are_out_of_reach_without_a_force(diagnosed: Diagnosed, case: str) -> None:
    report, _ = diagnosed(case, False)
    reasons = {entry["name"]: entry["reason"] for entry in report.excluded}
    assert "no force_n" in reasons["hinge_stiffness_error"]
    assert all("hinge_stiffness_error" not in group for group in (names(report), *report.alternatives))


def test_a_link_without_a_force_is_the_set_that_no_gap_can_tell_apart(diagnosed: Diagnosed) -> None:
    report, _ = diagnosed("link", False)
    assert report.verdict is Verdict.AMBIGUOUS
    assert set(report.alternatives) == {("lever_ratio_error",), ("input_scale",)}
    assert any(
        note.startswith("measure force_n too: lever_ratio_error differs from input_scale") for note in report.notes
    )


@pytest.mark.slow
def test_the_corrected_drawing_agrees_and_keeps_its_kind(diagnosed: Diagnosed, tmp_path: Path) -> None:
    report, folder = diagnosed("right half", False)
    share = report.effects[0].parameters["share"]
    assert share.u is not None
    assert abs(share.value + 0.0024) < SIGMAS * share.u + 1e-4  # a lever 1 % longer: -0.97 % / 4
    write_model(tmp_path / "model.toml", DRAWING, {e.name: dict(e.parameters) for e in report.effects}, "lumped")
    model = read_model(tmp_path / "model.toml")
    assert model.kind == "lumped"
    assert compare(read_measured_table(folder / "measured.csv"), model).rms_mm < NOISE_SHARE * EDGE_MM


@pytest.mark.slow
def test_an_uncertain_thickness_is_refitted_and_nothing_is_missing(tmp_path: Path) -> None:
    report = answered(CASES["hinges"], tmp_path, force=True, drawing=uncertain(tmp_path, thickness_mm=0.1))
    assert report.verdict is Verdict.AGREES, report.sentence
    note = next(note for note in report.notes if note.startswith("hinge.thickness_mm was refitted to "))
    assert float(note.split()[4]) == pytest.approx(0.9, abs=0.001)  # 400 samples determine the thickness to 0.0005 mm
    assert note.endswith("drawn as 1 +-0.1.")
    assert report.disagreement.after_rms_mm < NOISE_SHARE * EDGE_MM


@pytest.mark.slow
def test_what_is_surer_than_the_change_is_not_bent_to_it(tmp_path: Path) -> None:
    report = answered(CASES["link"], tmp_path, force=True, drawing=uncertain(tmp_path, l2_mm=0.01))
    assert names(report) == ["lever_ratio_error"]
    ratio = report.effects[0].parameters["ratio"]
    assert ratio.u is not None
    assert abs(ratio.value + 0.0097) < SIGMAS * ratio.u


def test_compare_refits_the_drawing_too_and_says_so(tmp_path: Path) -> None:
    measured = read_measured_table(table(CASES["link"], tmp_path, force=True))
    found = compare(measured, read_model(uncertain(tmp_path, l2_mm=0.2)))
    assert found.rms_mm < NOISE_SHARE * EDGE_MM
    assert found.data.refitted()[0].startswith("lever.l2_mm was refitted to 17.99")


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('kind = "lump"', r"must be one of finite_element, lumped, stiffness_matrix, but is lump: choose one"),
        ('[[effect]]\nname = "backlsh"\n[effect.parameters]', r"but is 'backlsh': did you mean backlash\?"),
        (
            '[[effect]]\nname = "backlash"\n[effect.parameters]\nplay = { value = 0.01 }',
            r"must state play_mm, but states play: rename it",
        ),
    ],
)
def test_a_wrong_corrected_model_is_refused_in_a_sentence(tmp_path: Path, lines: str, words: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(f'schema = 1\nbase = "{DRAWING}"\n{lines}\n', encoding="utf-8")
    with pytest.raises(DataError, match=words):
        read_model(path)
