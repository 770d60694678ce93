"""The play operator: the output follows the input with a dead band of one width (Visintin 1994, III.2)."""

from fingervision.domain.effect import Array
from fingervision.domain.loops import filled, loop

_play, _sliders = loop("play_operator_play"), loop("play_operator_sliders")


def play(input_mm: Array, width_mm: float, start: float) -> Array:
    """Output of a play operator of full width `width_mm` for the input of one run; shape (n,).

    The initial output lies `start` half widths above the first input; -1 and 1 are the two ends of the play.
    """
    return filled(_play, input_mm, width_mm, start)


def drawn_sliders(input_mm: Array, reach_mm: float, count: int, start: float) -> Array:
    """Sum of the extensions of `count` elastic sliders (Prandtl-Ishlinskii model of friction) over one run; shape (n,).

    The reach (largest extension) of slider k is k / count of `reach_mm`, and its extension is the difference between
    the input and the output of a play operator whose full width is twice the slider's reach. The initial extension of
    every slider is the fraction `start` of its reach.
    """
    return filled(_sliders, input_mm, reach_mm, count, start)
