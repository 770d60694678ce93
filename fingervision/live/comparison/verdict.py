"""A preliminary verdict by the command `diagnose`, in a separate process while the measurement continues."""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import Any

from fingervision.live.background import BackgroundCommand
from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.out_folder import out_folder

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
LOOK_EVERY_S = 0.1
VERDICT = "Seeking a verdict"
COLUMNS = ("run", "time_s", "input_mm", "gap_mm", "left_mm", "right_mm", "u_gap_mm", "u_random_mm", "force_n")


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

    def stop(self) -> None:
        """Stop the running diagnosis, and start no further diagnosis."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()

    def _seek(self, rows: list[GapRow]) -> None:
        folder = self._out / f"verdict_{self._number}"
        table = folder / "live_samples.csv"
        with out_folder(folder):
            write_table(table, rows)
        arguments = ("diagnose", str(table), "--model", str(self._model), "--kind", self._kind, "--out", str(folder))
        command = BackgroundCommand(*arguments)
        while command.exit_code is None and not self._ending.wait(LOOK_EVERY_S):
            pass
        code, complaint = command.exit_code, command.complaint
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


def write_table(path: Path, rows: Sequence[GapRow]) -> None:
    """Write rows as a measured table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in rows:
            cells = [row.run or "1", *(getattr(row, name) for name in COLUMNS[1:])]
            writer.writerow(
                ["" if each is None else f"{each:.9g}" if isinstance(each, float) else each for each in cells]
            )


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
