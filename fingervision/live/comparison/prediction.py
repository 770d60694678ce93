"""The gap that a model predicts for each row with a known input, in order of arrival."""

from collections import OrderedDict, deque
from collections.abc import Sequence
from threading import Lock

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Array, History
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.gaps_csv import GapRow

# Number of rows of the past path on which effects with memory depend: one minute at 25 frames per second. The gripper
# is taken as at rest before this path.
ROWS_BEHIND = 1500
# Number of stored predictions, several times the number of rows that a page is sent.
PREDICTIONS_KEPT = 20_000


class Prediction:
    """Predicts the gap of each row, and stores the prediction.

    Parameters
    ----------
    model : CorrectedModel
        The model with its effects, if any; effects with memory depend on the path of the input.
    """

    def __init__(self, model: CorrectedModel) -> None:
        self.model = model
        zero = float(model.base.respond(np.zeros(1)).gap_mm[0])
        over = model.base.respond(np.array(model.input_range_mm)).gap_mm - zero
        self._rest_gap_mm, self._opening_mm = zero, float(np.max(np.abs(over)))
        self._closing_mm = float(max(0.0, -np.min(over)))
        self._known: OrderedDict[int, float | None] = OrderedDict()
        self._path: deque[tuple[float, float]] = deque(maxlen=ROWS_BEHIND)
        self._run = ""
        self._lock = Lock()

    def clear(self) -> None:
        """Discard all predictions, because the row numbers have started again."""
        with self._lock:
            self._known.clear()
            self._path.clear()

    def predicted_mm(self, rows: Sequence[GapRow]) -> list[float | None]:
        """Predicted gap of each row (mm); None for a row whose input is unknown or outside the model's range.

        Parameters
        ----------
        rows : sequence of GapRow
            Rows in order; gaps that were predicted before are not computed again.
        """
        with self._lock:
            fresh = [row for row in rows if row.frame not in self._known]
            for run_rows in _by_run(fresh):
                self._add(run_rows)
            while len(self._known) > PREDICTIONS_KEPT:
                self._known.popitem(last=False)
            return [self._known.get(row.frame) for row in rows]

    def _add(self, rows: Sequence[GapRow]) -> None:
        low, high = self.model.input_range_mm
        inside = [row for row in rows if row.input_mm is not None and low <= row.input_mm <= high]
        for row in rows:
            self._known[row.frame] = None
        if not inside:
            return
        if inside[0].run != self._run:
            self._run = inside[0].run
            self._path.clear()
        self._path.extend((row.time_s or 0.0, row.input_mm or 0.0) for row in inside)
        gap_mm = self._respond()[-len(inside) :]
        # With more new rows than the stored path has, the first of them get no prediction.
        for row, value in zip(inside[-len(gap_mm) :], gap_mm, strict=True):
            self._known[row.frame] = float(value)

    def _respond(self) -> Array:
        time_s, input_mm = (np.array(column) for column in zip(*self._path, strict=True))
        if not self.model.effects:
            return np.asarray(self.model.base.respond(input_mm).gap_mm)
        history = History(
            input_mm=input_mm,
            time_s=time_s,
            runs=(slice(0, input_mm.size),),
            rest_gap_mm=self._rest_gap_mm,
            opening_mm=self._opening_mm,
            closing_mm=self._closing_mm,
        )
        fixed = {name: {key: each.value for key, each in values.items()} for name, values in self.model.effects.items()}
        return np.asarray(MeasuringChain(self.model.base, history, fixed).respond({}).gap_mm)


def _by_run(rows: Sequence[GapRow]) -> list[list[GapRow]]:
    found: list[list[GapRow]] = []
    for row in rows:
        if found and (found[-1][-1].run == row.run or row.input_mm is None):
            found[-1].append(row)
        else:
            found.append([row])
    return found
