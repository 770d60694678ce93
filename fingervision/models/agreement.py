"""Find quantities on which different kinds of model of one drawing disagree, and name the kind to trust.

A disagreement is a difference larger than the stated model errors of the two kinds together plus 10 %.
"""

from collections.abc import Callable, Mapping
from itertools import combinations

from fingervision.models.answer_figures import ModelFigures
from fingervision.models.kinds import by_trust, why_trusted

_APART = 0.10
"""Relative difference, beyond the sum of the two kinds' stated errors, above which two kinds are reported to disagree.
A larger difference means that the two kinds represent the body's geometry differently."""
_Figure = Callable[[ModelFigures], float | None]
_QUANTITIES: tuple[tuple[str, str, _Figure, Callable[[ModelFigures], float]], ...] = (
    ("gap per input", "", lambda f: f.gap_per_input, lambda f: f.slope_error),
    ("force per input", " N/mm", lambda f: f.input_stiffness_n_mm, lambda f: f.force_error),
    ("first mode, drive free", " Hz", lambda f: next(iter(f.free_modes_hz), None), lambda f: f.mode_error),
    ("first mode, drive held", " Hz", lambda f: next(iter(f.locked_modes_hz), None), lambda f: f.mode_error),
)


def disagreements(figures: Mapping[str, ModelFigures]) -> list[str]:
    """Compare the gap per input, the force per input and the first modes between every pair of kinds of model.

    Parameters
    ----------
    figures : mapping of str to ModelFigures
        Results of each model, by the name of its kind.

    Returns
    -------
    list of str
        One sentence for each quantity on which kinds disagree; if several pairs of kinds disagree, it is about the pair
        with the largest difference.
    """
    kinds = by_trust(figures)
    sentences = []
    for name, unit, value, error in _QUANTITIES:
        worst = None
        for better, other in combinations(kinds, 2):
            a, b = value(figures[better]), value(figures[other])
            if a is None or b is None:
                continue
            errors = error(figures[better]) + error(figures[other])
            apart = abs(b - a) / max(abs(a), 1e-300)
            if apart > _APART + errors and (worst is None or apart > worst[0]):
                worst = (apart, better, other, a, b, errors)
        if worst is not None:
            apart, better, other, a, b, errors = worst
            sentences.append(
                f"{better} and {other} must agree on the {name} within the sum of their model errors, "
                f"{100.0 * errors:.2g} %, but have {a:.4g} and {b:.4g}{unit}, {100.0 * apart:.3g} % apart; trust "
                f"{better}: {why_trusted(better) or 'it is listed first'}."
            )
    return sentences
