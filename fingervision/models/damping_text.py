"""Parse the short text of a damping law that is given to `model --damping`."""

from math import isfinite, pi

from fingervision.domain.errors import UsageError
from fingervision.models.damping import Damping, LossFactor, ModalDamping, PaperDamping, RayleighDamping

FORMS = "modal:0.025, loss:0.05, rayleigh:0.025:45:360 (ratio and two frequencies in Hz) or paper[:0.5]"
_MOST = 0.3


def parse_damping(text: str) -> Damping:
    """Parse a damping law.

    Parameters
    ----------
    text : str
        `modal:RATIO`, `loss:FACTOR` (twice the ratio), `rayleigh:RATIO:HZ:HZ`, `paper` or `paper:GAMMA`: equation (4)
        of Hricko & Havlik (2015) relative to the lowest vibrating mode.

    Raises
    ------
    UsageError
        If the text has none of these forms, or its damping ratio is not possible for a solid.
    """
    law, *parts = text.split(":")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = [float("nan")]
    counts = {"modal": (1,), "loss": (1,), "rayleigh": (3,), "paper": (0, 1)}
    if len(numbers) not in counts.get(law, ()) or not all(isfinite(x) and x > 0.0 for x in numbers):
        raise UsageError(f"--damping must be {FORMS}, with positive numbers, but is {text}.")
    if law == "paper":
        return PaperDamping(None, *numbers)
    ratio = 0.5 * numbers[0] if law == "loss" else numbers[0]
    if ratio >= _MOST:
        raise UsageError(
            f"--damping must give a damping ratio below {_MOST:g}, which no solid exceeds, but {text} gives {ratio:g}."
        )
    if law == "modal":
        return ModalDamping(ratio)
    if law == "loss":
        return LossFactor(numbers[0])
    if not numbers[1] < numbers[2]:
        raise UsageError(f"--damping rayleigh must have two frequencies in Hz, the lower one first, but is {text}.")
    return RayleighDamping(ratio, 2.0 * pi * numbers[1], 2.0 * pi * numbers[2])
