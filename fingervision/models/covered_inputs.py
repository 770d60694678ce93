"""Range of inputs for which an elastic model of a gripper is valid."""

from fingervision.domain.gripper import Gripper

_CLOSING = 1.5
_OPENING = 5.0
_OF_HEIGHT = 0.01


def covered_inputs_mm(gripper: Gripper, first_touch_mm: float | None) -> tuple[float, float]:
    """Smallest and largest valid input: 1.5 times, and minus five times, the input of first touch.

    For the published gripper the range is -0.77 to 2.6 mm; its hinges begin to yield at the upper end. Outside this
    range the models still compute results, but these results must not be trusted. For a gripper whose fingers never
    touch, the range is a hundredth of the height in either direction.
    """
    if first_touch_mm is None:
        return -_OF_HEIGHT * gripper.body.height_mm, _OF_HEIGHT * gripper.body.height_mm
    ends = _CLOSING * first_touch_mm, -_OPENING * first_touch_mm
    return min(ends), max(ends)
