"""Errors of measured gaps over their stated uncertainty, as several benchmarks print them."""

import time
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import Settings
from fingervision.vision.single_picture import measure_picture

Floats = NDArray[np.float64]
BEYOND_PX = 0.25


def rms(values: Floats) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def percent(held: NDArray[np.bool_]) -> float:
    """Share of what holds."""
    return 100.0 * float(np.mean(held))


@dataclass
class Scores:
    """What the frames of a class gave: error and both parts of the uncertainty of each gap, and the refused ones."""

    found: list[tuple[float, float, float]] = field(default_factory=list)
    lost: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    def measure(self, frame: Frame, settings: Settings, gap_px: float) -> None:
        """Measure a frame of known gap."""
        begun = time.process_time()
        outcome = measure_picture(frame, settings)
        self.seconds += time.process_time() - begun
        self.take(outcome, gap_px)

    def take(self, outcome: GapMeasurement | NoGap, gap_px: float) -> None:
        """Note what a frame of known gap gave."""
        if isinstance(outcome, GapMeasurement):
            self.found.append((outcome.gap_px - gap_px, outcome.u_gap_px, outcome.u_picture_px))
        else:
            self.lost[str(outcome.status)] += 1

    @cached_property
    def columns(self) -> Floats:
        """Error, random and systematic part of the standard uncertainty (px), shape (3, n)."""
        return np.array(self.found).reshape(-1, 3).T

    @property
    def error(self) -> Floats:
        """Errors of the gaps (px)."""
        return np.asarray(self.columns[0])

    @property
    def u(self) -> Floats:
        """Standard uncertainty of each gap, both parts together (px)."""
        return np.hypot(*self.columns[1:])

    @property
    def unsaid(self) -> float:
        """Percentage of gaps that are off by more than 0.25 px and by more than twice their uncertainty."""
        off = np.abs(self.error)
        return percent((off > BEYOND_PX) & (off > 2.0 * self.u))

    @property
    def refused(self) -> dict[str, int] | str:
        """Statuses of the frames without a gap."""
        return dict(self.lost) or ""
