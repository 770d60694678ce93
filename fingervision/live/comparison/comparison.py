"""Comparison of the live measurement with a model: the feature `model` of a view."""

import json
from collections import OrderedDict, deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from shutil import copyfile
from threading import Event, Lock, Thread
from typing import Any

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Array, History
from fingervision.live.background import BackgroundCommand
from fingervision.live.view import View
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.drive_csv import DRIVE_LOG
from fingervision.storage.gaps_csv import DRIVE_COLUMNS, GapRow, GapsCsv
from fingervision.storage.out_folder import out_folder
from fingervision.storage.summary_json import GAPS, SUMMARY
from fingervision.tables.read import read_model

# A preliminary verdict by the command `diagnose`, in a separate process while the measurement continues.


# Smallest number of rows during motion: four seconds at 25 frames per second. Fewer rows say almost nothing about
# effects with memory or with a period.
LEAST_ROWS = 100
# Smallest number of reversals: a difference between the two directions of motion shows only in a motion forth and back.
LEAST_TURNS = 1
# A motion over less than this share of the model's range is regarded as noise of the stage.
LEAST_SHARE = 0.02
# Factor by which the number of rows must grow before the next verdict: while the stage moves, and at rest.
MORE_ROWS, MORE_AT_REST = 1.5, 1.1
# Largest number of rows in a diagnosis, the newest two minutes at 25 frames per second; more rows would take longer.
MOST_ROWS = 3000
VERDICT = "Seeking a verdict"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Result of the command `diagnose`.

    Parameters
    ----------
    rows : int
        Number of samples that were diagnosed.
    verdict, sentence : str
        Verdict and its sentence, as in report.json.
    effects : tuple of (str, str)
        Name and described parameters of each effect that was named.
    next_run : str
        Path of the recipe that would distinguish the remaining explanations; empty if there is none.
    report : str
        Path of the report in HTML.
    """

    rows: int
    verdict: str
    sentence: str
    effects: tuple[tuple[str, str], ...]
    next_run: str
    report: str


class VerdictSeeker:
    """Starts a diagnosis whenever enough new rows have arrived.

    Parameters
    ----------
    model : Path
        File of any model that `diagnose` accepts.
    kind : str
        Kind of model to build from a gripper.toml.
    range_mm : (float, float)
        Smallest and largest input of the model.
    out : Path
        Folder for tables and results.
    view : View
        The view, which tells the verdict.
    """

    def __init__(self, model: Path, kind: str, range_mm: tuple[float, float], out: Path, view: View) -> None:
        self._model, self._kind, self._out, self._view = model, kind, out, view
        self._least_mm = LEAST_SHARE * (range_mm[1] - range_mm[0])
        self.newest: Verdict | None = None
        self._judged = 0
        self._number = 0
        self._ending = Event()
        self._thread: Thread | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a diagnosis is running."""
        return self._thread is not None and self._thread.is_alive()

    def consider(self, rows: Sequence[GapRow], moved: int, *, at_rest: bool) -> None:
        """Start a diagnosis if there are enough rows in all, and enough new rows since the last diagnosis.

        Parameters
        ----------
        rows : sequence of GapRow
            The most recent rows with known inputs, in order.
        moved : int
            Number of rows so far that were measured while the input moved.
        at_rest : bool
            Whether the motion has ended; fewer new rows are then sufficient for a diagnosis.
        """
        if self.is_busy or self._ending.is_set() or moved < LEAST_ROWS:
            return
        if moved < (MORE_AT_REST if at_rest else MORE_ROWS) * self._judged or turns(rows, self._least_mm) < LEAST_TURNS:
            return
        self._judged = moved
        self._number += 1
        kept = list(rows[-MOST_ROWS:])
        self._thread = self._view.supervisor.start(VERDICT, partial(self._seek, kept))

    def forget(self) -> None:
        """Discard the verdict, and stop the diagnosis that is running: their rows have been measured anew."""
        if self._ending.is_set():
            return
        self.stop()
        self._ending, self.newest, self._judged = Event(), None, 0

    def stop(self) -> None:
        """Stop the running diagnosis, and start no further diagnosis."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()

    def _seek(self, rows: list[GapRow]) -> None:
        folder, whole = self._out / f"verdict_{self._number}", self._view.table
        table = folder / GAPS
        with out_folder(folder):
            with GapsCsv(table, DRIVE_COLUMNS) as written:
                written.add([replace(row, run=row.run or "1") for row in rows])
            if whole is not None:  # the clock of a recording, and its log, belong to its rows
                for name in (SUMMARY, DRIVE_LOG):
                    if (whole.parent / name).is_file():
                        copyfile(whole.parent / name, folder / name)
        arguments = ("diagnose", str(table), "--model", str(self._model), "--kind", self._kind, "--out", str(folder))
        command = BackgroundCommand(*arguments)
        code, complaint = command.ended(self._ending)
        command.stop()
        if code is None:
            return
        if code != 0:
            self._view.supervisor.alarm(VERDICT, complaint or f"diagnose ended with exit code {code}.")
            return
        self.newest = read_verdict(folder, len(rows))
        self._view.say("verdict", f"After {len(rows)} samples: {self.newest.sentence}")


def turns(rows: Sequence[GapRow], least_mm: float) -> int:
    """Number of reversals of the input, between motions of at least `least_mm`."""
    count, way, extreme = 0, 0, None
    for row in rows:
        at = row.input_mm
        if at is None:
            continue
        if extreme is None:
            extreme = at
        elif way >= 0 and at < extreme - least_mm:
            count, way, extreme = count + (way > 0), -1, at
        elif way <= 0 and at > extreme + least_mm:
            count, way, extreme = count + (way < 0), 1, at
        else:
            extreme = max(extreme, at) if way > 0 else min(extreme, at) if way < 0 else extreme
    return count


def read_verdict(folder: Path, rows: int) -> Verdict:
    """Read the result of the command `diagnose` from its folder."""
    report: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    proposal = report.get("next_run") or {}
    return Verdict(
        rows=rows,
        verdict=report["verdict"],
        sentence=report.get("sentence") or report["verdict"],
        effects=tuple((each["name"], _in_words(each["parameters"])) for each in report["effects"]),
        next_run=str(folder / proposal["recipe"]) if proposal.get("recipe") else "",
        report=str(folder / "report.html"),
    )


def _in_words(parameters: dict[str, Any]) -> str:
    words = []
    for name, each in parameters.items():
        if isinstance(each, dict) and "value" in each:
            u = "" if each.get("u") is None else f" ± {2.0 * each['u']:.2g}"
            unit = str(each.get("unit", ""))
            # The name's ending that states the unit is removed, because the unit follows the value.
            told = name.removesuffix(f"_{unit.lower().replace('/', '_')}").replace("_", " ")
            words.append(f"{told} {each['value']:.4g}{u} {unit}".strip())
    return ", ".join(words)


# The gap that a model predicts for each row with a known input, in order of arrival.


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
            Rows in order; gaps that were predicted before are not computed again. A row may come again once its input
            is known.
        """
        with self._lock:
            fresh = [row for row in rows if row.input_mm is not None and row.frame not in self._known]
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
        path = [*self._path, *((row.time_s or 0.0, row.input_mm or 0.0) for row in inside)]
        self._path.extend(path[-len(inside) :])
        for row, value in zip(inside, self._respond(path)[-len(inside) :], strict=True):
            self._known[row.frame] = float(value)

    def _respond(self, path: Sequence[tuple[float, float]]) -> Array:
        time_s, input_mm = (np.array(column) for column in zip(*path, strict=True))
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
        self.verdicts.forget()
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
            "recent": len(rows),
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
