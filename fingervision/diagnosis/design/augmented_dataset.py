"""Measured data with a simulated further run appended, as one estimation problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.uncertain_dimensions import tangent
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.run_offsets import RunOffsets
from fingervision.diagnosis.noise.whitening import Whitener
from fingervision.domain.effect import Array, Flags, History, InputPath
from fingervision.domain.model import PhysicalModel

PAUSE_S = 30.0
"""Time between the data and the appended run, for saving and starting."""
AT_END = 1e-3
"""Distance from an end of its range, as a share of the range, within which a parameter counts as lying at the end."""
REFITTED = 8
"""Iterations of a refit."""
Settings = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True, eq=False)
class AugmentedDataset:
    """The measured data, followed by a proposed run that has not been executed yet.

    Parameters
    ----------
    first : Problem
        The data.
    both : Problem
        Estimation problem for data and run together; its `measured` is a placeholder.
    data_mm : ndarray of float, shape (channels * n,)
        The measured values in the form in which predictions are fitted to them.
    channels : int
        Number of channels: the gap, then midline and force if measured.
    """

    first: Problem
    both: Problem
    data_mm: Array
    channels: int

    @classmethod
    def of(cls, data: Observations, first: Problem, input_mm: Array, *, rezeroed: bool = False) -> "AugmentedDataset":
        """Append a proposed run with the same noise, later on the same clock; it may begin with a re-zeroing."""
        old = data.chain.history
        n, more = old.input_mm.size, input_mm.size
        time = float(old.times.max()) + PAUSE_S + old.sample_time_s * np.arange(more)
        history: History = replace(
            old,
            input_mm=np.concatenate([old.input_mm, input_mm]),
            time_s=np.concatenate([old.times, time]),
            runs=(*old.runs, slice(n, n + more)),
            rezeroed=(*(old.rezeroed or (False,) * len(old.runs)), rezeroed or any(old.rezeroed)),
        )
        count = len(data.channels)
        whitener, drawn = first.whitener, data.model.base
        chain = replace(first.chain, history=history, path=_longer(first.chain.path, history, n))

        def longer(values: Array) -> Array:
            return np.concatenate([values, np.full(more, float(np.median(values)))])

        aside: Flags = _behind(whitener.aside.astype(np.float64), np.zeros(count * more), count) > 0.0
        both = Whitener(
            history,
            whitener.noises,
            aside,
            longer(whitener.input_mm),
            whitener.input_samples,
            longer(whitener.passing_mm),
            tangent(chain, drawn, data.refit.moved).columns
            if data.refit.moved and isinstance(drawn, PhysicalModel)
            else None,
        )
        joined = replace(
            first, chain=chain, whitener=both, measured=np.zeros(count * (n + more)), offsets=RunOffsets.of(both)
        )
        return cls(first, joined, data.aim_mm, count)

    @property
    def input_mm(self) -> Array:
        """Input of the proposed run alone (mm)."""
        return self.both.chain.history.input_mm[self.first.chain.history.input_mm.size :]

    def moved(self, names: tuple[str, ...], values: Settings) -> Point:
        """Parameter values for data plus proposed run; an end stop outside the data is placed outside data and run."""
        out: Point = {name: dict(values[name]) for name in names}
        before = {(name, parameter.name): parameter for name, parameter in self.first.parameters(names)}
        for name, now in self.both.parameters(names):
            if (name, now.name) not in before:
                out[name][now.name] = 0.0  # start state of the new run
                continue
            was = before[name, now.name]
            near = AT_END * (was.upper - was.lower)
            value = values[name][was.name]
            if was.lower != now.lower and value <= was.lower + near:
                out[name][was.name] = now.lower
            elif was.upper != now.upper and value >= was.upper - near:
                out[name][was.name] = now.upper
        return out

    def distance(
        self,
        truth: Settings,
        rival: Explanation,
        *,
        sigma_mm: tuple[float, ...] | None = None,
        iterations: int = REFITTED,
    ) -> float:
        """Squared whitened distance, over data and proposed run, between the predictions of two explanations."""
        target = self.both.whitened(self.moved(tuple(truth), truth))
        start = self.moved(rival.names, rival.values)
        return fit(self.both, rival.names, start, target=target, sigma_mm=sigma_mm, iterations=iterations).score

    def expected(self, truth: Settings) -> Array:
        """Whitened target: the measured data, followed by the noise-free prediction for the appended run."""
        shown = self.both.chain.stacked(self.moved(tuple(truth), truth)).reshape(self.channels, -1)
        new = shown[:, self.data_mm.size // self.channels :]
        return self.both.whitener.one(_behind(self.data_mm, new.ravel(), self.channels))

    def score(
        self, target: Array, explanation: Explanation, starts: Sequence[Settings], sigma_mm: tuple[float, ...] | None
    ) -> float:
        """Chi-square of an explanation refitted to a target signal, from the best of several points after one step.

        Offsets of runs are treated in the same way as in `distance`.
        """
        names = explanation.names
        begins = [self.moved(names, start) for start in starts]
        tries = [fit(self.both, names, begin, target=target, sigma_mm=sigma_mm, iterations=1) for begin in begins]
        best = min(tries, key=lambda found: found.score)
        return fit(self.both, names, best.values, target=target, sigma_mm=sigma_mm, iterations=REFITTED).score


def _behind(old: Array, new: Array, channels: int) -> Array:
    """Append each channel of the proposed run to that channel of the measured data; shape (channels * n,)."""
    return np.concatenate([old.reshape(channels, -1), new.reshape(channels, -1)], axis=1).ravel()


def _longer(path: InputPath | None, history: History, first_rows: int) -> InputPath | None:
    """Append the rows of a second run to the path of the input; `history` holds the rows of both runs."""
    if path is None:
        return None
    old, new = path.history, slice(first_rows, history.input_mm.size)
    begin, more = old.input_mm.size, history.input_mm.size - first_rows
    both = replace(
        history,
        input_mm=np.concatenate([old.input_mm, history.input_mm[new]]),
        time_s=np.concatenate([old.times, history.times[new]]),
        runs=(*old.runs, slice(begin, begin + more)),
    )
    rows = np.concatenate([path.rows, np.arange(begin, begin + more)])
    return InputPath(both, rows, np.concatenate([path.owner, np.arange(first_rows, first_rows + more)]))
