"""Positioning accuracy in a diagnosis: as measured, corrected for the named effects, and the share of each effect."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.report.positioning_accuracy import positioning_accuracy
from fingervision.diagnosis.report.positioning_figures import PositioningAccuracy
from fingervision.domain.effect import Array, Values
from fingervision.motion.repeated_targets import RepeatedTargets


@dataclass(frozen=True, slots=True)
class PositioningReport:
    """Positioning accuracy as measured, after the correction, and with the predicted change of each effect subtracted.

    Parameters
    ----------
    measured : PositioningAccuracy
        Quantities of measured minus simulated values, or of measured minus target values.
    after : PositioningAccuracy or None
        Quantities of the residual after all named effects; None if none was named.
    without : mapping of str to PositioningAccuracy
        By effect, quantities of the measured deviations minus that effect's predicted change.
    assumed : tuple of str
        Assumptions on the targets and their sides of approach.
    reference : str
        Reference of the deviations: `target` or `model`.
    slope_sign : int
        +1 if the gap rises with the input, -1 if it falls: play then causes a reversal of opposite sign.
    """

    measured: PositioningAccuracy
    after: PositioningAccuracy | None
    without: Mapping[str, PositioningAccuracy]
    assumed: tuple[str, ...] = ()
    reference: str = "target"
    slope_sign: int = 1

    def share_mm(self, effect: str, symbol: str) -> float | None:
        """Quantity as measured minus the quantity without the effect (mm); negative if the effect hides a part of it.

        Most quantities are ranges or maxima, so that the shares need not add up to the quantity; only the shares of
        B_mean add up.
        """
        whole, rest = self.measured.figures[symbol].value_mm, self.without[effect].figures[symbol].value_mm
        return None if whole is None or rest is None else whole - rest

    @property
    def cycles(self) -> tuple[int, int]:
        """Smallest and largest number of visits of a target from one side."""
        counts = [v.n for t in self.measured.targets for v in (t.up, t.down) if v is not None]
        return (min(counts), max(counts)) if counts else (0, 0)


def effect_changes(
    predict_mm: Callable[[Mapping[str, Values]], Array], answer: Mapping[str, Values]
) -> dict[str, Array]:
    """Change of the prediction by each named effect, with the other effects present.

    Parameters
    ----------
    predict_mm : callable
        Predicted gap of the measured rows, shape (m,), for the parameters of the effects that act.
    answer : mapping of str to mapping of str to float
        Effects found, with their parameters.
    """
    whole = predict_mm(answer)
    return {
        name: whole - predict_mm({other: values for other, values in answer.items() if other != name})
        for name in answer
    }


def positioning_report(
    visits: RepeatedTargets,
    measured_mm: Array,
    after_mm: Array | None = None,
    changes_mm: Mapping[str, Array] | None = None,
    reference: str = "target",
    slope_sign: int = 1,
) -> PositioningReport:
    """Compute the positioning quantities as measured, corrected, and without each effect.

    Parameters
    ----------
    visits : RepeatedTargets
        Target, side and cycle of the m measured rows.
    measured_mm : ndarray of float, shape (m,)
        Position minus target, or measured gap minus that of the model without the effects found.
    after_mm : ndarray of float, shape (m,), or None
        Measured gap minus that of the model with all effects found.
    changes_mm : mapping of str to ndarray of float, shape (m,), or None
        By effect, the change of the predicted gap: prediction with all effects minus prediction with all others, so
        that an effect that acts through another is counted for both.
    reference : str
        Reference of the deviations: `target` or `model`.
    slope_sign : int
        +1 if the gap rises with the input, -1 if it falls.
    """

    def figures(deviation_mm: Array) -> PositioningAccuracy:
        return positioning_accuracy(visits.target_mm, deviation_mm, visits.direction, visits.cycle)

    without = {
        name: figures(np.asarray(measured_mm - change, dtype=np.float64)) for name, change in (changes_mm or {}).items()
    }
    return PositioningReport(
        figures(measured_mm),
        None if after_mm is None else figures(after_mm),
        without,
        visits.notes,
        reference,
        slope_sign,
    )
