"""Comparison of the live measurement with a model: the feature `model` of a view."""

from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.live.comparison.prediction import Prediction
from fingervision.live.comparison.verdict import MOST_ROWS, VerdictSeeker
from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapRow
from fingervision.tables.read import read_model

# Number of rows from which the page's mean and scatter of the residual are computed: ten seconds at 25 frames per
# second.
ROWS_SHOWN = 250
# Number of rows between checks whether there are enough rows for a verdict: one second at 25 frames per second.
ROWS_BETWEEN = 25


class Comparison:
    """Compares measured rows whose input is known with a model.

    Parameters
    ----------
    view : View
        The view that supplies the rows.
    path : Path
        File of any model that `diagnose` accepts.
    kind : str
        Kind of model to build from a gripper.toml.

    Raises
    ------
    FingervisionError
        The model cannot be read.
    """

    def __init__(self, view: View, path: Path, kind: str = "lumped") -> None:
        model = read_model(path, kind)
        self.path, self.input_mm = path, None
        self._prediction = Prediction(model)
        self.verdicts = VerdictSeeker(path, kind, model.input_range_mm, view.out / "verdicts", view)
        self._rows: deque[GapRow] = deque(maxlen=MOST_ROWS)
        self._recent: deque[GapRow] = deque(maxlen=ROWS_SHOWN)
        self._total = self._moved = self._still = 0

    def predicted_mm(self, rows: Sequence[GapRow]) -> list[float | None]:
        """Predict the gap of rows (mm); None for a row whose input is unknown."""
        return self._prediction.predicted_mm(rows)

    def add(self, row: GapRow, arrived_s: float = 0.0) -> None:
        """Add a row as soon as it is measured."""
        if row.input_mm is None or row.time_s is None:
            return
        self._take(row)
        if self._total % ROWS_BETWEEN == 0 or self._still == ROWS_BETWEEN:
            self.verdicts.consider(tuple(self._rows), self._moved, at_rest=self._still >= ROWS_BETWEEN)

    def add_all(self, rows: Sequence[GapRow]) -> None:
        """Add the rows of a completely measured recording."""
        self._rows.clear()
        self._recent.clear()
        self._prediction.clear()
        self._total = self._moved = self._still = 0
        for row in rows:
            if row.input_mm is not None and row.time_s is not None:
                self._take(row)
        self.verdicts.consider(tuple(self._rows), self._moved, at_rest=True)

    def _take(self, row: GapRow) -> None:
        """Store a measured row for the comparison.

        During a long rest of the stage, only some rows are stored: many rows at one position would outweigh the motion
        without adding information.
        """
        stands = bool(self._recent) and self._recent[-1].input_mm == row.input_mm
        self._still = self._still + 1 if stands else 0
        self._recent.append(row)
        self._total += 1
        self._moved += not stands
        if self._still < ROWS_BETWEEN or self._still % ROWS_BETWEEN == 0:
            self._rows.append(row)

    def stop(self) -> None:
        """Stop requesting verdicts."""
        self.verdicts.stop()

    def state(self) -> dict[str, Any]:
        """Return the state of the comparison, for the browser page."""
        rows = list(self._recent)
        pairs = [
            (row.gap_mm - gap_mm, row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm)
            for row, gap_mm in zip(rows, self._prediction.predicted_mm(rows), strict=True)
            if gap_mm is not None and row.gap_mm is not None
        ]
        residual = np.array([each for each, _ in pairs])
        u_mm = [u for _, u in pairs if u is not None]
        found = self.verdicts.newest
        return {
            "path": str(self.path),
            "samples": self._total,
            "moved": self._moved,
            "input_mm": rows[-1].input_mm if rows else None,
            "mean_um": float(1e3 * residual.mean()) if residual.size else None,
            "rms_um": float(1e3 * np.sqrt(np.mean(residual**2))) if residual.size else None,
            "band_um": float(2e3 * np.median(u_mm)) if u_mm else None,
            "busy": self.verdicts.is_busy,
            "verdict": None
            if found is None
            else {
                "rows": found.rows,
                "verdict": found.verdict,
                "sentence": found.sentence,
                "effects": [list(each) for each in found.effects],
                "next_run": found.next_run,
                "report": found.report,
            },
        }
