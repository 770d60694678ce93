"""S-N line (fatigue strength) of a material in a drawing.

`sn_line = { cycles = [1e4, 1e6], amplitude_mpa = [28.0, 16.0], stress_ratio = -1.0 }`
"""

from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import SNLine
from fingervision.storage.finite import is_number

_KEYS = ("cycles", "amplitude_mpa", "stress_ratio")
_MOST_CYCLES = 1e12
_MOST_MPA = 1e5


def read_sn_line(raw: Any, name: str, origin: str) -> SNLine:
    """Read and check an S-N line.

    Parameters
    ----------
    raw : object
        The value as read from the file.
    name, origin : str
        Name of the key and of its file, for error messages.

    Raises
    ------
    DataError
        The amplitudes are not positive and decreasing, or the numbers of cycles do not increase.
    """
    what = f"{name} in {origin}"
    if not isinstance(raw, dict) or not {"cycles", "amplitude_mpa"} <= set(raw) <= set(_KEYS):
        raise DataError(
            f"{what} must be {{ cycles = [first, last], amplitude_mpa = [at first, at last] }}, with stress_ratio "
            f"where that is not -1, but is {raw!r}."
        )
    cycles = _two(raw["cycles"], f"{name}.cycles in {origin}", _MOST_CYCLES)
    amplitude = _two(raw["amplitude_mpa"], f"{name}.amplitude_mpa in {origin}", _MOST_MPA)
    ratio = raw.get("stress_ratio", -1.0)
    if not is_number(ratio) or not -10.0 <= ratio < 1.0:
        raise DataError(
            f"{name}.stress_ratio in {origin} must be the smallest over the largest stress, below 1, but is {ratio!r}."
        )
    if not (cycles[1] > cycles[0] >= 1.0 and amplitude[0] > amplitude[1] > 0.0):
        raise DataError(
            f"{what} must fall as the number of cycles rises, but goes from {amplitude[0]:g} MPa at "
            f"{cycles[0]:g} cycles to "
            f"{amplitude[1]:g} MPa at {cycles[1]:g}."
        )
    return SNLine(cycles, amplitude, float(ratio))


def check_below_yield(line: SNLine, yield_mpa: float, origin: str) -> None:
    """Refuse an S-N line whose peak stress (amplitude plus mean stress of the tests) reaches the yield stress."""
    mean = abs(line.amplitude_mpa[0] * (1.0 + line.stress_ratio) / (1.0 - line.stress_ratio))
    if mean + line.amplitude_mpa[0] > yield_mpa * (1.0 + 1e-9):
        raise DataError(
            f"material.sn_line in {origin} must stay below the yield stress, {yield_mpa:g} MPa, but reaches "
            f"{mean + line.amplitude_mpa[0]:g} MPa at {line.cycles[0]:g} cycles; begin the line at more cycles."
        )


def _two(raw: Any, what: str, most: float) -> tuple[float, float]:
    if not isinstance(raw, list) or len(raw) != 2 or not all(is_number(x) and abs(x) <= most for x in raw):
        raise DataError(f"{what} must be two numbers of at most {most:g}, but is {raw!r}.")
    return float(raw[0]), float(raw[1])
