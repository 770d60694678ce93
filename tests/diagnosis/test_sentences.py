"""The sentence of a result stays short for any number of effects; sizes of effects are printed in separate lines."""

from fingervision.diagnosis.report.sentences import answer, detail_lines
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import Disagreement, NamedEffect, Verdict

NAMES = ("backlash", "hinge_stiffness_error", "thermal_drift")
EFFECTS = tuple(NamedEffect(name, "drive", {"size_mm": Estimate(0.123, 0.004, "mm")}) for name in NAMES)
DISAGREEMENT = Disagreement(0.4, 0.01, 0.005, None, None, {})
SHORT = 250
"""Largest number of characters: three lines of a terminal with 80 columns."""


def test_a_set_of_many_explanations_is_counted_and_listed() -> None:
    alternatives = tuple((*NAMES, f"other_effect_{k}") for k in range(6))
    said = answer(Verdict.AMBIGUOUS, None, EFFECTS, alternatives, DISAGREEMENT)
    assert "6 explanations" in said
    assert len(said) < SHORT
    lines = detail_lines(Verdict.AMBIGUOUS, EFFECTS, alternatives)
    for names in alternatives:
        assert any(all(name in line for name in names) for line in lines)
    for name in NAMES:
        assert any("best fit" in line and name in line and "U = 0.008 mm" in line for line in lines)


def test_a_small_set_is_named_in_the_sentence() -> None:
    said = answer(Verdict.AMBIGUOUS, None, EFFECTS[:1], (NAMES[:1], NAMES[1:]), DISAGREEMENT)
    assert "2 explanations" in said
    assert all(name in said for name in NAMES)


def test_one_named_effect_has_its_size_in_the_sentence_and_three_have_lines() -> None:
    assert "U = 0.008 mm" in answer(Verdict.NAMED, None, EFFECTS[:1], (NAMES[:1],), DISAGREEMENT)
    assert not detail_lines(Verdict.NAMED, EFFECTS[:1], (NAMES[:1],))
    assert len(answer(Verdict.NAMED, None, EFFECTS, (NAMES,), DISAGREEMENT)) < SHORT
    assert len(detail_lines(Verdict.NAMED, EFFECTS, (NAMES,))) == len(EFFECTS)
