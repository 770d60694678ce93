"""The play operator: the output follows the input with a dead band of one width (Visintin 1994, III.2)."""

from fingervision.domain.effect import Array
from fingervision.domain.loops import filled, loop

_play = loop("play_operator_play")


def play(input_mm: Array, width_mm: float, start: float) -> Array:
    """Output of a play of full width `width_mm` for one run's input; shape (n,).

    Initially the output lies `start` half widths above the first input; -1 and 1 are the two ends of the play.
    """
    return filled(_play, input_mm, width_mm, start)
