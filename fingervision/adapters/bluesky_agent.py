"""An agent for bluesky that suggests the next run, and a plan that executes the steps of a recipe.

`NextRunAgent` receives measured rows (by `ingest`, or as a subscriber of the RunEngine), diagnoses these rows, and
suggests the run that best distinguishes the remaining explanations (`suggest`). The module needs the extra `bluesky`.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fingervision.adapters.bluesky import GapDevice, StageDevice
from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.domain.errors import DataError
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.row_file import write_table
from fingervision.tables.read import read_measured_table

ROW = ("run", "time_s", "input_mm", "gap_mm", "left_mm", "right_mm", "force_n")


class NextRunAgent:
    """Diagnoses measured rows, and suggests the run that best distinguishes the remaining explanations.

    Parameters
    ----------
    model : CorrectedModel
        Model that is compared with the measurement (`fingervision.tables.read.read_model`).
    gap : str
        Name of the `GapDevice` whose events the agent receives as a subscriber (`RE.subscribe(agent)`).
    seed : int
        Random seed of the diagnosis.
    """

    def __init__(self, model: CorrectedModel, gap: str = "gap", *, seed: int = 1) -> None:
        self._model, self._gap, self._seed = model, gap, seed
        self._rows: list[dict[str, Any]] = []
        self._run = 0
        self._answer: Diagnosis | None = None

    def ingest(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Add rows with `input_mm` and any of `gap_mm`, `run`, `time_s`, `left_mm`, `right_mm`, `force_n`."""
        for row in rows:
            if row.get("input_mm") is None:
                raise DataError(f"Every row must have input_mm, but one has {sorted(row)}: add input_mm.")
            self._rows.append({"run": str(self._run), **{key: row.get(key) for key in ROW if row.get(key) is not None}})
        self._answer = None

    def __call__(self, name: str, document: Mapping[str, Any]) -> None:
        """Receive the documents of a RunEngine; each run of the RunEngine becomes a run of the table."""
        if name == "start":
            self._run += 1
        if name == "event":
            self._ingest_event(document["data"], document["timestamps"])
        if name == "event_page":
            for k in range(len(document["time"])):
                data, stamps = (
                    {key: values[k] for key, values in document[part].items()} for part in ("data", "timestamps")
                )
                self._ingest_event(data, stamps)

    def report(self) -> Diagnosis:
        """Diagnose all rows received so far."""
        if self._answer is None:
            with TemporaryDirectory(prefix="fingervision-") as folder:
                path = Path(folder) / "measured.csv"
                keys = [key for key in ROW if any(row.get(key) is not None for row in self._rows)]
                write_table(path, keys, ([row.get(key) for key in keys] for row in self._rows), digits=17)
                self._answer = diagnose(read_measured_table(path), self._model, seed=self._seed)
        return self._answer

    def suggest(self, batch_size: int = 1) -> list[dict[str, Any]]:
        """Suggest the next run: `name`, `steps` as in a recipe, `separates`; empty if a single explanation remains."""
        proposed = self.report().report.next_run
        if proposed is None or batch_size < 1:
            return []
        steps = [dict(step) for step in proposed.steps]
        return [{"name": proposed.name, "steps": steps, "separates": list(proposed.separates)}]

    def _ingest_event(self, data: Mapping[str, Any], timestamps: Mapping[str, float]) -> None:
        prefix = f"{self._gap}_"
        own = {key.removeprefix(prefix): value for key, value in data.items() if key.startswith(prefix)}
        if own.get("input_mm") is not None:
            # The time of the exposure. The document's own time is that of its writing, which after a flight is the same
            # for all frames within milliseconds.
            self.ingest([{**own, "run": str(self._run), "time_s": timestamps[f"{prefix}input_mm"]}])


def run_steps(steps: Sequence[Mapping[str, Any]], stage: StageDevice, gap: GapDevice) -> Iterator[Any]:
    """Return a bluesky plan for the steps of a recipe: one run, in which the gap is measured while the stage moves.

    The kinds triangle, move and hold are supported; other kinds of steps require `fingervision bed run`.
    """
    import bluesky.plan_stubs as bps
    import bluesky.preprocessors as bpp

    def moves() -> Iterator[Any]:
        for step in steps:
            kind, speed_mm_s = step.get("kind"), float(step.get("speed_mm_s", stage.speed_mm_s))
            if kind in ("triangle", "move"):
                ends = [step["from_mm"], *[step["to_mm"], step["from_mm"]] * int(step.get("cycles", 1))]
                for to_mm in ends if kind == "triangle" else [step["to_mm"]]:
                    yield from bps.prepare(stage, (float(to_mm), speed_mm_s), wait=True)
                    yield from bps.kickoff(stage, wait=True)
                    yield from bps.complete(stage, wait=True)
            elif kind == "hold":
                yield from bps.mv(stage, float(step["at_mm"]))
                yield from bps.sleep(float(step["seconds"]))
            else:
                raise DataError(
                    f"Under Bluesky a recipe step must be triangle, move or hold, but is {kind!r}: run this "
                    "recipe with `fingervision bed run`."
                )

    def flown() -> Iterator[Any]:
        yield from bps.kickoff(gap, wait=True)
        yield from moves()
        yield from bps.complete(gap, wait=True)
        yield from bps.collect(gap)

    yield from bpp.run_wrapper(flown())  # type: ignore[no-untyped-call]  # it carries no types
