"""The inputs that an elastic model of a gripper is meant for."""

from fingervision.domain.gripper import Gripper

_CLOSING = 1.5
_OPENING = 5.0
_OF_HEIGHT = 0.01


def covered_inputs_mm(gripper: Gripper, first_touch_mm: float | None) -> tuple[float, float]:
    """Smallest and largest input: half as far again as the first touch, and five times as far the other way.

    For the paper's sample -0.77 to 2.6 mm, where its hinges begin to yield; the models answer beyond as well, but
    nobody should believe them. Without a touch, a hundredth of the height either way.
    """
    if first_touch_mm is None:
        return -_OF_HEIGHT * gripper.body.height_mm, _OF_HEIGHT * gripper.body.height_mm
    ends = _CLOSING * first_touch_mm, -_OPENING * first_touch_mm
    return min(ends), max(ends)
