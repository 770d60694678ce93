"""Decide the verdict: effects are named only if they explain nearly all of the disagreement."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from fingervision.diagnosis.inference.held_out_prediction import rms_mm
from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.random_effect import FORM, estimated_coefficients
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.input.observations import FORM_SHARE_OF_RIGS, Observations
from fingervision.diagnosis.noise.channel_noises import most_noise
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.domain.effect import Array, Flags
from fingervision.domain.report import Verdict
from fingervision.motion.recorded_input import scatter_in_holds

STANDING_SHARE = 0.05
"""Largest share of the disagreement, as RMS, that named effects may leave: the inexactness of the catalogue's
formulas."""
STANDING_NOISES = 3.0
"""Residual in standard deviations of the noise that is acceptable in any case, because it is hardly visible."""
TRUSTED = 10.0
"""Largest ratio of the estimated noise to the measurement's own random uncertainty; above it, structure was mistaken
for noise."""
MANY_ASIDE = 0.1
"""Largest share of rows that may be gross errors if the model agrees; a larger share must have a cause."""
COMMON = 2.0
"""Mean of the runs' offsets, in standard errors from zero, above which it counts as a common constant."""
FEWEST_ROWS, ENOUGH_ROWS = 20, 100
"""Number of rows below which their own scatter is no noise without repeats, because its relative uncertainty exceeds a
sixth, and number of rows from which its spectrum tells noise from an error of the model. Between them, neighbouring
rows must not resemble each other (`resembling`)."""
MOST_SCATTER = 0.05
"""Largest ratio of the scatter of the gap to its predicted motion at which a table without effects agrees: ratios of
the catalogue are at most 0.2 to 0.3, of which a reading at an end of the motion must show half by two standard
deviations."""
BY_LUCK = 1.645
"""Standard deviations below its expectation at which von Neumann's ratio is significant at 5 %, one-sided."""
UNDECIDED = "The table cannot show whether simulation and measurement agree"
"""Beginning of an *unknown* result that found no structure, but no noise either."""
SCATTERED: str = f"{UNDECIDED}: the gap scatters"
"""Beginning of one whose noise hides every effect of a usual size."""
LACK_OF_FIT = 1e-3
"""Significance of the F ratio of lack of fit to pure error above which there is nothing to explain."""


@dataclass(frozen=True, slots=True)
class Standing:
    """The residual that an explanation leaves, as a share of the disagreement.

    All values are RMS over left and right if both are measured, else over the gap; the midline's constant, the runs'
    deviations from their common mean, and outliers are removed.

    Parameters
    ----------
    before_mm, after_mm : float
        RMS without and with the explanation.
    noise_mm : float
        RMS that a true explanation would leave: noise of the picture, and the recorded input's own error.
    rows : int
        Number of values used.
    noise_degrees : int or None
        Degrees of freedom of a noise estimated from repeats; None for a noise estimated from the residual itself.
    rounding_mm : float
        Largest rounding error of a reading: half of its last digit.
    aside_share : float
        Share of the rows excluded as gross errors.
    left_out : tuple of int
        Rows that were not used.
    noise_is_known : bool
        Whether repeats, a stated uncertainty or enough rows determine the noise, or no digit differs.
    gap_scatter_mm, gap_motion_mm : float
        Standard deviation of the residual of the gap, and range of the gap's prediction.
    """

    before_mm: float
    after_mm: float
    noise_mm: float
    rows: int
    noise_degrees: int | None
    rounding_mm: float = 0.0
    aside_share: float = 0.0
    left_out: tuple[int, ...] = ()
    noise_is_known: bool = True
    gap_scatter_mm: float = 0.0
    gap_motion_mm: float = 0.0

    @property
    def explained_share(self) -> float:
        """Explained share of the variance, 1 - (after / before)^2, from 0 to 1."""
        return float(np.clip(1.0 - (self.after_mm / max(self.before_mm, 1e-300)) ** 2, 0.0, 1.0))

    @property
    def share(self) -> float:
        """Ratio of the RMS after the explanation to that before it, from 0 to 1."""
        return float(min(1.0, self.after_mm / max(self.before_mm, 1e-300)))

    @property
    def is_little(self) -> bool:
        """Whether the remaining residual is only noise, or a small part of the disagreement.

        If repeated readings determine the noise, any residual beyond it is structure; a small structure may still be
        the usual inexactness of the effects' formulas on real stages.
        """
        if self.after_mm <= STANDING_SHARE * self.before_mm:
            return True
        structure_mm = float(np.sqrt(max(0.0, self.after_mm**2 - self.noise_mm**2)))
        told = self.noise_degrees is not None and not self.is_noise
        return self.after_mm <= STANDING_NOISES * self.noise_mm and not (
            told and structure_mm > FORM_SHARE_OF_RIGS * self.before_mm
        )

    @property
    def is_noise(self) -> bool:
        """Whether the remaining residual is within the scatter of repeats, the rounding, or the possible noise."""
        if self.after_mm <= self.rounding_mm:
            return True
        ratio = (self.after_mm / max(self.noise_mm, 1e-300)) ** 2
        if self.noise_degrees is None:
            return ratio <= STANDING_NOISES**2
        return float(fdtrc(self.rows, self.noise_degrees, ratio)) > LACK_OF_FIT


def standing(data: Observations, problem: Problem, before_mm: Array, after_mm: Array) -> Standing:
    """Compute the share of the disagreement that remains; `before_mm` and `after_mm` have shape (channels * n,)."""
    if data.run_gains is not None:
        after_mm = after_mm - data.run_gains.fitted_mm
    history = data.chain.history
    n, both, runs = history.input_mm.size, history.both_edges, history.runs
    aside = isolated(after_mm[:n], problem.whitener.aside[:n], runs)
    errors = data.measured_pure_errors(np.split(problem.whitener.aside, len(data.channels)))
    noises = limited_noises_mm(data, problem, after_mm, repeated=errors is not None)
    if data.table.u_random_mm is not None:
        most_mm = TRUSTED * float(np.median(data.table.u_random_mm))
        noises[0] = min(noises[0], most_mm or noises[0])
    error = np.hypot(problem.whitener.input_mm, problem.whitener.passing_mm)[~aside]
    gap2 = noises[0] ** 2 + float(np.mean(error**2)) if error.size else noises[0] ** 2
    noise = float(np.sqrt(0.25 * gap2 + noises[1] ** 2)) if both else float(np.sqrt(gap2))

    def rms(residual: Array) -> float:
        parts = [_without_scatter(part, runs)[~aside] for part in np.split(residual, len(data.channels))]
        return rms_mm(np.concatenate(parts), kept, both)

    kept, gross = int(np.sum(~aside)), float(np.mean(aside & ~data.distrusted))
    degrees = None if errors is None else min(error.degrees for error in errors)
    half_digit_mm = 0.5 * resolution(data.table.gap_mm)
    rounding_mm = half_digit_mm if data.repeats is not None else 0.0
    left_out = tuple(np.flatnonzero(aside).tolist())
    left_mm = rms(after_mm)
    stated = degrees is not None or data.table.u_random_mm is not None or left_mm <= half_digit_mm
    gap_mm = _without_scatter(after_mm[:n], runs)[~aside]
    told = kept >= ENOUGH_ROWS or (kept >= FEWEST_ROWS and not resembling(gap_mm, history.input_mm[~aside]))
    known = stated or told
    scatter_mm, motion_mm = float(np.std(gap_mm)), float(np.ptp(data.chain.stacked({})[:n]))
    return Standing(
        rms(before_mm), left_mm, noise, kept, degrees, rounding_mm, gross, left_out, known, scatter_mm, motion_mm
    )


def limited_noises_mm(data: Observations, problem: Problem, residual_mm: Array, *, repeated: bool) -> list[float]:
    """Noise of each channel (mm), at most what the residual's fast changes, its holds and repeated passes show.

    In a spectrum, slow structure, jumps, and the motion of the stage after a command could count as noise.

    Parameters
    ----------
    data, problem : Observations, Problem
        The measurement, and the noise estimated from it.
    residual_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted values.
    repeated : bool
        Whether repeated readings determine the noise of readings at rest.
    """
    history, noises = data.chain.history, [noise.total_mm for noise in problem.whitener.noises]
    digits = resolution(data.table.gap_mm) / float(np.sqrt(12.0))
    parts = np.split(residual_mm, len(data.channels))
    if history.commanded:
        limits = [max(scatter_in_holds(history, part), digits) for part in parts]
    elif history.time_s is not None and not repeated:
        limits = [most_noise(part, history.input_mm, history.runs, digits) for part in parts]
    else:
        return noises
    return [min(noise, limit or noise) for noise, limit in zip(noises, limits, strict=True)]


def resembling(residual_mm: Array, input_mm: Array) -> bool:
    """Whether neighbouring rows resemble each other, by order or by input, so that the residual may be structure.

    Von Neumann's ratio of the mean squared successive difference to twice the variance is 1 for independent values,
    with a standard deviation of 1 / sqrt(n) (von Neumann 1941, doi:10.1214/aoms/1177731677).
    """
    variance = float(np.var(residual_mm))
    ordered = (residual_mm, residual_mm[np.argsort(input_mm, kind="stable")])
    least = min(float(np.mean(np.diff(values) ** 2)) for values in ordered)
    return least < 2.0 * variance * (1.0 - BY_LUCK / float(np.sqrt(residual_mm.size)))


def isolated(residual_mm: Array, aside: Flags, runs: tuple[slice, ...]) -> Flags:
    """Mark isolated rows among those set aside in the fit; all other rows set aside belong to the disagreement.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Measured minus predicted gap.
    aside : ndarray of bool, shape (n,)
        Rows set aside in the fit.
    runs : tuple of slice
        Rows of each run.
    """
    return aside & ~_leans(residual_mm, aside, runs)


def _leans(residual_mm: Array, aside: Flags, runs: tuple[slice, ...]) -> Flags:
    """Mark the rows set aside as gross errors that are the peak of a wider deviation, and so part of the disagreement.

    A gross error is isolated. Next to the peak of a wider deviation, the nearest row that was kept deviates in the same
    direction by more than half as much.
    """
    leans = np.zeros(aside.size, dtype=bool)
    for run in runs:
        kept = np.flatnonzero(~aside[run]) + run.start
        if not kept.size:
            continue
        rows = np.flatnonzero(aside[run]) + run.start
        after = np.searchsorted(kept, rows)
        for beside in (kept[np.maximum(after - 1, 0)], kept[np.minimum(after, kept.size - 1)]):
            leans[rows] |= residual_mm[beside] * residual_mm[rows] > 0.5 * residual_mm[rows] ** 2
    return leans


def _without_scatter(values: Array, runs: tuple[slice, ...]) -> Array:
    """Subtract each run's deviation from the mean of all runs; a significant offset shared by all runs remains.

    Each run may be zeroed anew. A mean offset is not significant if the scatter of the runs' offsets causes a mean as
    large.
    """
    means = np.array([values[run].mean() for run in runs])
    common = float(means.mean())
    if len(runs) > 1 and abs(common) < COMMON * float(np.std(means, ddof=1)) / len(runs) ** 0.5:
        common = 0.0
    out = values.copy()
    for run, mean in zip(runs, means, strict=True):
        out[run] -= mean - common
    return out


def standing_of(data: Observations, found: Findings) -> Standing:
    """Unexplained fraction after a search, with a map of position errors subtracted to first order."""
    before = data.stacked_mm - data.chain.stacked({})
    left = data.stacked_mm - data.chain.stacked(found.best.values) - form_error_mm(data, found)
    if data.position_map is not None:
        left = left - data.position_map.refitted(found.problem, found.best).fitted_mm
    if data.run_gains is not None:
        data = replace(data, run_gains=data.run_gains.refitted(found.problem, found.best))
    return standing(data, found.problem, before, left)


def form_error_mm(data: Observations, found: Findings) -> Array:
    """Estimated error of the formulas of the best explanation, as far as its kind is known; shape (m,) (mm)."""
    columns_mm = data.form_errors_mm(found.best.values)
    coefficients, _ = estimated_coefficients(found.problem, found.best, FORM)
    if columns_mm.shape[1] != coefficients.size:
        return np.zeros(columns_mm.shape[0])
    return np.asarray(columns_mm @ coefficients, dtype=np.float64)


def verdict(found: Findings, *, mapped: bool, stands: Standing) -> tuple[Verdict, str | None]:
    """Return the verdict that follows from the residual, and describe any *unknown* structure."""
    named = bool(found.best.names) or mapped
    remains = (
        f"{1e3 * stands.after_mm:.3g} um RMS remain, {100.0 * stands.share:.0f} % of the disagreement; noise would be "
        f"{1e3 * stands.noise_mm:.2g} um"
    )
    if found.unknown is not None:
        return Verdict.UNKNOWN, found.unknown
    if not named and stands.aside_share > MANY_ASIDE:
        return (
            Verdict.UNKNOWN,
            f"{100.0 * stands.aside_share:.0f} % of the rows deviate far from the model, the remaining rows agree with "
            "it",
        )
    if not named:
        if not stands.is_noise:
            return Verdict.UNKNOWN, remains
        if not stands.noise_is_known:
            return (
                Verdict.UNKNOWN,
                f"{UNDECIDED}: no position was read twice from the same side often enough to show the noise, no "
                f"u_random_mm is stated, and {stands.rows} rows are too few to distinguish noise from an error of the "
                f"model; the difference is {1e3 * stands.after_mm:.3g} um RMS. Read the positions again, with times, "
                "or state u_random_mm",
            )
        if stands.gap_scatter_mm > MOST_SCATTER * stands.gap_motion_mm:
            return (
                Verdict.UNKNOWN,
                f"{SCATTERED} by {1e3 * stands.gap_scatter_mm:.3g} um about a predicted motion of "
                f"{1e3 * stands.gap_motion_mm:.3g} um, too large to tell. Find the cause of the scatter first, in the "
                "pictures of the rows that differ most, or drive a larger range",
            )
        return Verdict.AGREES, None
    if not stands.is_little:
        return Verdict.UNKNOWN, remains if found.left_over is None else f"{found.left_over}; {remains}"
    return (Verdict.NAMED if len(found.alternatives) < 2 else Verdict.AMBIGUOUS), None


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Result of a search, with its residual.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Findings
        Findings of the search.
    before_mm, after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted values, without and with the explanation found.
    stands : Standing
        Share of the disagreement that remains.
    """

    data: Observations
    found: Findings
    before_mm: Array
    after_mm: Array
    stands: Standing

    def values(self) -> Settings:
        """Parameters of everything that the search found: the effects, and the curve of a position map."""
        return _values(self.data, self.found)


def judged(data: Observations, found: Findings) -> Answer:
    """Compare the result with the disagreement; effects that increase the disagreement are removed from the result.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Findings
        Findings of the search.
    """
    before = data.stacked_mm - data.chain.stacked({})
    after = data.stacked_mm - data.chain.stacked(_values(data, found)) - form_error_mm(data, found)
    stands = standing(data, found.problem, before, after)
    digit = resolution(data.table.gap_mm) if data.recorded.commanded else 0.0
    n, edges = data.chain.history.input_mm.size, data.chain.history.both_edges
    is_larger = stands.after_mm > stands.before_mm or rms_mm(after, n, edges) > rms_mm(before, n, edges)
    if is_larger or stands.before_mm < digit:
        # Effects that increase the disagreement (outliers included) explain nothing. A disagreement below the last
        # digit of the readings is only rounding, which is constant in every hold.
        data, found = without_names(data, found, None if stands.before_mm < digit else found.unknown)
        after, stands = before, standing(data, found.problem, before, before)
    return Answer(data, found, before, after, stands)


def without_names(data: Observations, found: Findings, unknown: str | None) -> tuple[Observations, Findings]:
    """Remove all named effects from the result, including a map of position errors.

    Parameters
    ----------
    data, found
        Measurement, and findings of the search.
    unknown : str or None
        Reason why no effect is named.
    """
    nothing = replace(found, best=found.problem.nothing(), alternatives=(), unknown=unknown)
    return replace(data, position_map=None, run_gains=None), nothing


def _values(data: Observations, found: Findings) -> Settings:
    """Parameters of everything that the search found: the effects, and the curve of a position map."""
    if data.position_map is None:
        return found.best.values
    return {**found.best.values, NAME: data.position_map.values()}
