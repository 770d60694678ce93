"""Gauge repeatability and reproducibility: the share of a tolerance that the measurement's variation takes up."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError

Floats = NDArray[np.float64]

# Number of standard deviations that count as the spread of a gauge (AIAG, Measurement Systems Analysis, 4th ed. 2010,
# chapter III).
SPREAD = 6.0
# Verdicts of the same manual: good below 10 %, doubtful up to 30 %.
GOOD_PERCENT, DOUBTFUL_PERCENT = 10.0, 30.0

MOVING = 3.0
"""Ratio of the standard deviation of one part's readings to that estimated from successive differences, above which the
readings are not repeats of one value. The ratio is 1 +- 1 / sqrt(n) for independent readings (von Neumann 1941,
doi:10.1214/aoms/1177731677) and 0.41 n for n readings of a steady motion; a drift that triples the noise makes a gauge
study equally meaningless."""
FEWEST_TO_TELL = 12
"""Least number of readings for the test of motion; from fewer readings, standard deviations are too uncertain."""


@dataclass(frozen=True, slots=True)
class GaugeStudy:
    """Standard deviations of a gauge, from an analysis of variance.

    Parameters
    ----------
    repeatability_mm : float
        Equipment variation: repeated readings of the same part in the same recording.
    reproducibility_mm : float
        Appraiser variation: the same part in another recording (set up again, by somebody else, on another day),
        including the interaction of parts and recordings.
    part_mm : float
        Variation between the parts.
    parts, recordings, trials : int
        Number of parts, of recordings, and of trials of each part in each recording.
    """

    repeatability_mm: float
    reproducibility_mm: float
    part_mm: float
    parts: int
    recordings: int
    trials: int

    @property
    def grr_mm(self) -> float:
        """Combined standard deviation of repeatability and reproducibility (mm)."""
        return hypot(self.repeatability_mm, self.reproducibility_mm)

    def percent_of(self, tolerance_mm: float) -> float:
        """%GRR: six standard deviations of the gauge as a percentage of a tolerance's full width.

        Raises
        ------
        CalibrationError
            If the tolerance is not positive.
        """
        if not (isfinite(tolerance_mm) and tolerance_mm > 0.0):
            raise CalibrationError(
                f"The tolerance must be positive, but is {tolerance_mm} mm: give the full width of the tolerance."
            )
        return 100.0 * SPREAD * self.grr_mm / tolerance_mm

    @property
    def percent_of_total(self) -> float | None:
        """%GRR of the total variation; None if only one part was measured and there is no other variation."""
        total = hypot(self.grr_mm, self.part_mm)
        return 100.0 * self.grr_mm / total if self.parts > 1 and total > 0.0 else None


def refuse_moving(readings_mm: Sequence[float], name: str) -> None:
    """Refuse readings of one part in motion, because their spread is due to the motion, not to the gauge.

    Parameters
    ----------
    readings_mm : sequence of float
        Readings in the order in which they were taken.
    name : str
        Name of the part, for the error message.

    Raises
    ------
    CalibrationError
        The standard deviation of the readings is much larger than that of successive differences, because the gap
        moved.
    """
    values = np.asarray(readings_mm, dtype=np.float64)
    if values.size < FEWEST_TO_TELL:
        return
    spread = float(np.std(values, ddof=1))
    from_one_to_next = float(np.sqrt(0.5 * np.mean(np.diff(values) ** 2)))
    if spread > MOVING * from_one_to_next:
        raise CalibrationError(
            f"The readings of {name} must be repeated readings of one gap, but range from {values.min():.4f} to "
            f"{values.max():.4f} "
            f"mm (standard deviation {1e3 * spread:.3g} um, from reading to reading {1e3 * from_one_to_next:.3g} um): "
            "record a gap that does not move, or, if the stage moved in steps, add --by-input."
        )


def gauge_study(readings_mm: Sequence[Sequence[Sequence[float]]]) -> GaugeStudy:
    """Analyse a crossed study with random parts and recordings.

    The method is that of AIAG, Measurement Systems Analysis, 4th ed. 2010, appendix A (analysis of variance): variance
    components follow from mean squares, a negative component is set to zero, and an interaction that is not significant
    is pooled with repeatability.

    Parameters
    ----------
    readings_mm : nested sequence, shape (recordings, parts, trials)
        Readings with the same number of trials in each cell, and at least two in all.

    Raises
    ------
    CalibrationError
        The recordings differ in parts or readings, a reading is missing, or there are fewer than two recordings or
        readings.

    Examples
    --------
    Five gaps, four times in each of three recordings:

    >>> import numpy as np, calib
    >>> noise = np.random.default_rng(1)
    >>> gaps_mm = np.arange(1.0, 6.0)[None, :, None]
    >>> readings_mm = gaps_mm + 0.001 * noise.standard_normal((3, 5, 4)) + 0.001 * noise.standard_normal((3, 1, 1))
    >>> study = calib.gauge_study(readings_mm.tolist())
    >>> print(f"gauge repeatability and reproducibility: {1000 * study.grr_mm:.1f} um")
    gauge repeatability and reproducibility: 1.2 um

    The comparison of a reading with a certified value:

    >>> calib.Agreement(5.0011, 0.0008, 5.0, 0.0003).agrees
    True
    """
    lengths = {len(cell) for recording in readings_mm for cell in recording}
    if len(lengths) != 1 or len({len(recording) for recording in readings_mm}) != 1:
        raise CalibrationError(
            "Every recording must contain the same parts, and every part must have the same number of readings."
        )
    values = np.array(readings_mm, dtype=np.float64)
    recordings, parts, trials = values.shape
    if recordings < 2:
        raise CalibrationError(f"Reproducibility needs at least two recordings, but there are {recordings}.")
    if trials < 2:
        raise CalibrationError(f"Repeatability needs at least two readings of each part, but there are {trials}.")
    if not np.all(np.isfinite(values)):
        raise CalibrationError("Every reading must be a number, but some are missing: leave those parts out.")
    mean = float(values.mean())
    cells, by_recording, by_part = values.mean(axis=2), values.mean(axis=(1, 2)), values.mean(axis=(0, 2))
    within = float(np.sum((values - cells[:, :, None]) ** 2))
    among_recordings = parts * trials * float(np.sum((by_recording - mean) ** 2))
    among_parts = recordings * trials * float(np.sum((by_part - mean) ** 2))
    crossed = trials * float(np.sum((cells - by_recording[:, None] - by_part + mean) ** 2))
    freedom_within, freedom_crossed = recordings * parts * (trials - 1), (recordings - 1) * (parts - 1)
    repeatability = within / freedom_within
    interaction = crossed / freedom_crossed if freedom_crossed else repeatability
    shows = interaction > repeatability
    if not shows:
        repeatability = (within + crossed) / (freedom_within + freedom_crossed)
        interaction = repeatability
    of_interaction = (interaction - repeatability) / trials
    of_recording = max(0.0, (among_recordings / (recordings - 1) - interaction) / (parts * trials))
    of_part = max(0.0, (among_parts / (parts - 1) - interaction) / (recordings * trials)) if parts > 1 else 0.0
    return GaugeStudy(
        repeatability_mm=float(np.sqrt(repeatability)),
        reproducibility_mm=float(np.sqrt(of_recording + of_interaction)),
        part_mm=float(np.sqrt(of_part)),
        parts=parts,
        recordings=recordings,
        trials=trials,
    )


def verdict(percent: float) -> str:
    """Meaning of a %GRR, in the words of the AIAG manual."""
    if percent < GOOD_PERCENT:
        return "acceptable"
    return "may be acceptable for some uses" if percent <= DOUBTFUL_PERCENT else "not acceptable"


# Coverage factor of expanded uncertainties, for a coverage of about 95 % (JCGM 100:2008, 6.2).
COVERAGE_FACTOR = 2.0


@dataclass(frozen=True, slots=True)
class Agreement:
    """Comparison of a measurement with a certified value.

    Parameters
    ----------
    measured_mm, u_measured_mm : float
        Measured value, with its standard uncertainty.
    certified_mm, u_certified_mm : float
        Certified value, with its standard uncertainty.
    """

    measured_mm: float
    u_measured_mm: float
    certified_mm: float
    u_certified_mm: float

    @property
    def deviation_mm(self) -> float:
        """Measured value minus certified value."""
        return self.measured_mm - self.certified_mm

    @property
    def e_n(self) -> float:
        """Ratio `E_n` of deviation to expanded uncertainty (ISO 13528:2022); a magnitude of at most 1 is agreement."""
        expanded = COVERAGE_FACTOR * hypot(self.u_measured_mm, self.u_certified_mm)
        return self.deviation_mm / expanded if expanded > 0.0 else float("inf")

    @property
    def agrees(self) -> bool:
        """Whether the deviation lies within its expanded uncertainty."""
        return abs(self.e_n) <= 1.0
