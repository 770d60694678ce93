"""Position over time of an actuator without a readable encoder, computed from its motion profiles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.testbed.motion.motion_profile import MotionProfile

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Piece:
    begin_s: float
    from_mm: float
    motion: MotionProfile
    # End of the motion; earlier than planned if the motion was interrupted.
    until_s: float


class CommandedPath:
    """Position over time, constant between motions.

    Parameters
    ----------
    at_mm : float
        Initial position.
    """

    def __init__(self, at_mm: float) -> None:
        self._pieces: list[_Piece] = [_Piece(-np.inf, at_mm, MotionProfile(0.0, 0.0, 0.0, 0.0, 0.0), np.inf)]

    def begin(self, begin_s: float, motion: MotionProfile) -> None:
        """Begin a motion at the position where the last one ended."""
        self._pieces.append(_Piece(begin_s, self.at_mm(begin_s), motion, np.inf))

    def jump(self, time_s: float, to_mm: float) -> None:
        """Set the position from a time on, after homing or after a turn by hand."""
        self._pieces.append(_Piece(time_s, to_mm, MotionProfile(0.0, 0.0, 0.0, 0.0, 0.0), np.inf))

    def break_off(self, time_s: float) -> None:
        """End the present motion at a time."""
        last = self._pieces[-1]
        self._pieces[-1] = _Piece(last.begin_s, last.from_mm, last.motion, max(time_s, last.begin_s))

    def at_mm(self, time_s: float) -> float:
        """Position at a time (mm)."""
        piece = next((each for each in reversed(self._pieces) if each.begin_s <= time_s), self._pieces[0])
        since_s = min(time_s, piece.until_s) - piece.begin_s
        return piece.from_mm + float(piece.motion.travelled_mm(np.array([since_s]))[0])

    def times_of_motion_s(self, from_s: float, to_s: float, every_s: float) -> Floats:
        """Times at intervals of `every_s`, between two times, at which the stage is in motion (s).

        Returns
        -------
        ndarray of float, shape (n,)
        """
        times = []
        for piece in self._pieces:
            end_s = min(to_s, piece.until_s, piece.begin_s + piece.motion.seconds)
            begin_s = max(from_s, piece.begin_s)
            if piece.motion.seconds > 0.0 and begin_s < end_s:
                times.append(np.arange(begin_s + every_s, end_s, every_s))
        found = np.concatenate(times) if times else np.empty(0)
        return found[found < to_s]
