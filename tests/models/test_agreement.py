"""Kinds of model that differ by more than their errors are reported, with the kind to trust."""

from fingervision.models.answer_figures import ModelFigures
from fingervision.models.kinds import disagreements


def figures(slope: float, force: float, mode: float | None = None) -> ModelFigures:
    modes = () if mode is None else (mode,)
    return ModelFigures(slope, force, free_modes_hz=modes, slope_error=0.01, force_error=0.02, mode_error=0.05)


def test_kinds_that_agree_say_nothing() -> None:
    assert disagreements({"lumped": figures(7.7, 2.1, 46.0), "finite_element": figures(7.6, 2.0, 44.0)}) == []


def test_each_quantity_has_one_sentence_and_says_whom_to_trust() -> None:
    told = disagreements(
        {
            "stiffness_matrix": figures(7.7, 2.6),
            "lumped": figures(7.7, 2.5, 60.0),
            "finite_element": figures(7.6, 2.0, 44.0),
        }
    )
    assert len(told) == 2
    assert "force per input" in told[0]
    assert "2 and 2.6 N/mm, 30 % apart; trust finite_element" in told[0]
    assert "first mode" in told[1]


def test_stated_errors_widen_what_is_allowed() -> None:
    # The kinds differ by 13.5 %, with errors of 2 % each: less than 10 % beyond the errors.
    assert disagreements({"lumped": figures(7.7, 2.27), "finite_element": figures(7.7, 2.0)}) == []
    assert disagreements({"lumped": figures(7.7, 2.30), "finite_element": figures(7.7, 2.0)}) != []
