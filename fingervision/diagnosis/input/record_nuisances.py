"""Errors of the recorded input that stand beside every effect: rounding, clock offset, reversals behind an encoder."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Array, History
from fingervision.motion.encoder_path import reversals

# Systematic error of the recorded input: differences in the stage's motion below this error are not significant.

OF_ROUNDING, OF_NOISE = 0.5, 0.1
"""Shares of the encoder's rounding error, and of the input's noise, that do not average out over many samples: equal
positions are rounded equally, whereas noise is smoothed."""


def below_the_input(problem: Problem, size_mm: float) -> bool:
    """Whether a change of the gap is smaller than the change that the input's error or its encoder step may cause."""
    history = problem.chain.history
    share = OF_ROUNDING if history.input_step_mm > 0.0 else OF_NOISE
    gap = problem.chain.stacked({})[: history.input_mm.size]
    return size_mm < share * float(np.ptp(gap)) / history.input_span_mm * history.input_sigma_mm


# Error of a clock offset that was estimated from the same motion, as a random effect.

FREEDOM = 3.0
"""Factor on the offset's uncertainty for its prior when it is refitted. The offset was found from these same data, so
that its uncertainty is not independent knowledge: with 3 u the prior adds a ninth of the data's information, whereas
with u the data would count twice, and the uncertainty of a play that is correlated with the offset would be
understated."""


def clock_columns(chain: MeasuringChain, u_clock_s: float, values: Mapping[str, Mapping[str, float]]) -> Array:
    """Change of the stacked prediction per standard deviation of the clock offset's prior; shape (m, 1), or (m, 0).

    Parameters
    ----------
    chain : MeasuringChain
        Model with the recorded input.
    u_clock_s : float
        Standard uncertainty of the offset; 0 if both have the same clock.
    values : mapping
        Effects found so far. A later clock delays the prediction with all effects: while a play is taken up, the gap
        is constant, and does not depend on the offset.
    """
    history = chain.history
    if u_clock_s == 0.0 or history.time_s is None:
        return np.zeros((chain.stacked({}).size, 0))
    # Step of the difference: the offset's uncertainty, but at most half a sample, over which the record is straight.
    step_s = min(u_clock_s, 0.5 * history.sample_time_s)
    predicted = chain.stacked(values).reshape(-1, history.input_mm.size)
    change = [moved(history, one, step_s) - moved(history, one, -step_s) for one in predicted]
    return np.asarray(np.concatenate(change) * (FREEDOM * u_clock_s / (2.0 * step_s)))[:, None]


def moved(history: History, values: Array, by_s: float) -> Array:
    """Values of each run at times later by `by_s`; shape (n,)."""
    out = np.empty_like(values)
    for run in history.runs:
        time_s = history.times[run]
        out[run] = np.interp(time_s + by_s, time_s, values[run])
    return out


MOST_TURNS = 60
"""Number of reversals above which their errors are left to the noise: they average out, and each costs two
predictions."""
SMALL = 0.1
"""Step of the derivative in standard uncertainties of the input: small compared with a play, which is not linear."""


@dataclass(frozen=True, slots=True, eq=False)
class TurningErrors:
    """Unknown position of each reversal of the stage within the step of its encoder.

    At a reversal the stage is so slow that many readings are rounded to the same line. Their common error does not
    average out, and an effect with memory, such as a play, keeps the position of the reversal until the play is taken
    up. Of 46 simulated plays of 50 to 150 um (`tests.benchmarks.world`, rows with encoders, seed 301), the errors fell
    from 2.2 to 0.45 um RMS, and their mean from 1.05 to -0.16 um, when these errors were random effects: a play follows
    the largest of several uncertain positions, so that it came out too wide.

    Parameters
    ----------
    shapes_mm : ndarray of float, shape (n, turns)
        Error of the input near each reversal, per standard uncertainty: largest at the reversal, zero one step from it.
    sigma_mm : float
        Standard uncertainty of one recorded input.
    """

    shapes_mm: Array
    sigma_mm: float

    @classmethod
    def of(cls, history: History) -> "TurningErrors | None":
        """Find the reversals of a path that an encoder recorded; None without an encoder, or with too many of them."""
        step_mm, u = history.input_step_mm, history.input_mm
        turns = [turn for run in history.runs for turn in _turns(u, run, step_mm)] if step_mm > 0.0 else []
        if not 0 < len(turns) <= MOST_TURNS:
            return None
        shapes = np.zeros((u.size, len(turns)))
        for k, (near, at) in enumerate(turns):
            shapes[near, k] = history.input_sigma_mm * (1.0 - np.abs(u[near] - u[at]) / step_mm)
        return cls(shapes, history.input_sigma_mm)

    @property
    def apart(self) -> Array:
        """Share of each row's error that is not an error at a reversal: 0 at a reversal, 1 a step away; shape (n,)."""
        return np.asarray(1.0 - np.max(self.shapes_mm, axis=1) / self.sigma_mm)

    def columns_mm(self, chain: MeasuringChain, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Change of the stacked prediction of an explanation per standard uncertainty; shape (m, turns)."""
        input_mm = chain.history.input_mm
        found = []
        for shape in SMALL * self.shapes_mm.T:
            ends = [chain.with_input(input_mm + way * shape).stacked(values) for way in (-1.0, 1.0)]
            found.append((ends[1] - ends[0]) / (2.0 * SMALL))
        return np.stack(found, axis=1)


def _turns(input_mm: Array, run: slice, reach_mm: float) -> list[tuple[slice, int]]:
    """Reversals of a run by more than `reach_mm`: samples around each that lie within this reach, and its sample."""
    x, found = input_mm[run], []
    for before, at in pairwise([0, *reversals(x, reach_mm)]):
        far = np.abs(x - x[at]) >= reach_mm
        low = int(np.max(np.flatnonzero(far[before:at]), initial=-1)) + before + 1
        high = at + int(np.argmax(far[at:]))
        found.append((slice(run.start + low, run.start + high), run.start + at))
    return found
