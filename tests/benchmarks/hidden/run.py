"""Benchmark of hidden effects: simulate tables, diagnose them, and print a table of marks.

    python -m tests.benchmarks.hidden.run --tables 40 --jobs 2 --seed 1 --rows null,single_1

All results are stored under --out by seed, row and number, so that a run may be stopped and continued. All rows are
processed in turn. With --minutes M, no table is begun after that time; --minutes 0 prints the stored results; --again
repeats the diagnoses. --scheduler tcp://HOST:PORT uses a Dask cluster whose workers were started at the top of the
repository. Seeds below 1000 are for development, seeds from 1000 on for results.
"""

import json
import os
import shutil
import time
import traceback
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.frame import Namespace, answers, benchmark, listed
from tests.benchmarks.hidden.binomial import Rate
from tests.benchmarks.hidden.catalogue_chain import MAP
from tests.benchmarks.hidden.diagnose_adapter import Answer, diagnose, read_report
from tests.benchmarks.hidden.explanations import known_effects, problem_of
from tests.benchmarks.hidden.next_run_gain import Gain, gain_that_came
from tests.benchmarks.hidden.recipe import NotDrivenError
from tests.benchmarks.hidden.reported_effects import reported_effects
from tests.benchmarks.hidden.rows import ROWS
from tests.benchmarks.hidden.score import Mark, intervals, mark, row_lines
from tests.benchmarks.hidden.table_cache import JudgedTable, draw_table_of_row
from tests.benchmarks.hidden.unforeseen import widened
from tests.benchmarks.hidden.unseen_run import unseen_error_ratio

ANSWER = "diagnose.json"


@dataclass(frozen=True, slots=True)
class Task:
    """One table."""

    row: str
    index: int
    seed: int
    out: Path

    @property
    def folder(self) -> Path:
        """Folder of the table, the answer and the marks."""
        return self.out / f"seed{self.seed}" / self.row / f"{self.index:04d}"

    @property
    def kept(self) -> Path:
        """File of the marks."""
        return self.folder / "diagnose_marks.json"


def _ask(table: JudgedTable) -> Answer:
    kept = table.folder / ANSWER
    report = table.folder / "diagnosis" / "report.json"
    if kept.exists():
        held = json.loads(kept.read_text(encoding="utf-8"))
        if report.exists():
            return read_report(report, held["seconds"])
        return Answer(held["verdict"], tuple(frozenset(s) for s in held["sets"]), held["seconds"], held["report"])
    answer = diagnose(table.folder)
    held = {"verdict": answer.verdict, "sets": [sorted(s) for s in answer.sets], "seconds": answer.seconds}
    held["report"] = answer.report if answer.verdict == "failed" else {}
    kept.write_text(json.dumps(held, indent=1), encoding="utf-8")
    return answer


def marked(task: Task) -> dict[str, object]:
    """Result of `work`, stored with the table, so that an interrupted run can be continued."""
    if task.kept.exists():
        return dict(json.loads(task.kept.read_text(encoding="utf-8")))
    result = work(task)
    task.kept.write_text(json.dumps(result, indent=1), encoding="utf-8")
    return result


def work(task: Task) -> dict[str, object]:
    """Simulate a table, diagnose it, and mark the answer; returns a dictionary that can be stored."""
    row, folder = ROWS[task.row], task.folder
    table = draw_table_of_row(row, task.seed, task.index, folder)
    hidden = frozenset(h.name for h in table.experiment.plant.hidden)
    answer = _ask(table)
    given = mark(row, widened(table, answer, hidden), answer, hidden)
    result: dict[str, object] = {"mark": asdict(given), "verdict": answer.verdict, "seconds": answer.seconds}
    result |= {"sets": ["+".join(sorted(s)) for s in answer.sets], "hidden": "+".join(sorted(hidden))}
    result["folder"] = str(folder)
    if answer.verdict == "failed":
        return result
    known = known_effects(table.experiment, problem_of(table.experiment, table.experiment.traces(), known_input=False))
    if given.right and row.hidden and answer.sets:
        names = {c.name: c.names for c in known}
        covered = intervals(table.judgement, answer, names)
        result["intervals"] = [asdict(c) for c in covered]
        if MAP not in hidden | answer.sets[0]:
            result["unseen"] = unseen_error_ratio(table, reported_effects(answer.report, known))
    if row.hidden:
        try:
            gain = gain_that_came(table, answer)
        except NotDrivenError as reason:
            result["not_driven"] = str(reason)
        else:
            result["gain"] = asdict(gain) if gain else None
    return result


def guarded(task: Task) -> dict[str, object]:
    """Result of `marked`; an exception for one table is reported and does not end the run."""
    try:
        return marked(task)
    except Exception:
        return {"fault": traceback.format_exc(limit=6)}


def report_of(results: dict[str, list[dict[str, object]]]) -> list[str]:
    """Printed table."""
    lines = list[str]()
    for name, found in results.items():
        marks = [Mark(**r["mark"]) for r in found if "mark" in r]  # type: ignore[arg-type]
        lines += row_lines(ROWS[name], marks)
        failed = sum(r.get("verdict") == "failed" for r in found)
        faults = sum("fault" in r for r in found)
        if failed or faults:
            lines.append(f"{'':16s} no report: {failed}, faults of the benchmark: {faults}")
    every = [r for found in results.values() for r in found]
    near = [abs(c["deviation"]) <= 1.96 for r in every for c in r.get("intervals", [])]  # type: ignore[attr-defined]
    if near:
        lines.append(f"95 % intervals cover {Rate(sum(near), len(near))}")
    unseen = np.array([r["unseen"] for r in every if "unseen" in r])
    if len(unseen):
        median, ninety = np.quantile(unseen, [0.5, 0.9])
        lines.append(f"unseen run, error over the judge's: median {median:.3f}, 90th percentile {ninety:.3f}")
    gains = [Gain(**r["gain"]) for r in every if r.get("gain")]  # type: ignore[arg-type]
    large = [0.7 <= g.came / g.promised <= 1.3 for g in gains if g.promised >= 75]
    small = [g.low <= g.came <= g.high for g in gains if g.promised < 75]
    if gains:
        lines.append(f"proposed run, promises of 75 and more: within 0.7-1.3 {Rate(sum(large), len(large))}")
        lines.append(f"proposed run, smaller promises: interval holds {Rate(sum(small), len(small))}")
    apart = sum("not_driven" in r for r in every)
    if apart:
        lines.append(f"proposed run, recipes without a stand-in here: {apart}")
    seconds = [float(r["seconds"]) for r in every if r.get("seconds")]  # type: ignore[arg-type]
    if seconds:
        lines.append(f"seconds a table: median {np.median(seconds):.1f}, largest {max(seconds):.1f}")
    return lines


def _tasks(chosen: Namespace) -> list[Task]:
    """Tables, without their kept answers if they are to be diagnosed again."""
    numbers = range(chosen.first, chosen.first + chosen.tables)
    tasks = [Task(row, index, chosen.seed, chosen.out.absolute()) for index in numbers for row in chosen.rows]
    for task in tasks if chosen.again else ():
        (task.folder / ANSWER).unlink(missing_ok=True)
        task.kept.unlink(missing_ok=True)
    return tasks


def _tell(task: Task, result: dict[str, object], misses: Path | None) -> None:
    if "fault" in result:
        print(f"{task.row} {task.index}: {result['fault']}", flush=True)
    missed = "mark" in result and not result["mark"]["right"]  # type: ignore[index]
    if missed:
        said, hidden = result["verdict"], result["hidden"]
        print(
            f"   missed {task.row} {task.index}: hidden {hidden or '-'}, said {said} {result['sets']}",
            flush=True,
        )
        if misses is not None:
            name = f"{task.row}_seed{task.seed}_{task.index:04d}"
            shutil.copytree(str(result["folder"]), misses / name, dirs_exist_ok=True)


@benchmark(
    tables={"type": int, "default": 20, "help": "tables a row"},
    first={"type": int, "default": 0, "help": "number of the first table"},
    jobs=2,
    scheduler={"help": "Dask cluster, tcp://HOST:PORT; --out on a path that its workers see"},
    seed=1,
    rows=listed(ROWS),
    out=Path("results/hidden"),
    again={"action": "store_true", "help": "diagnose tables with a kept answer again"},
    misses={"type": Path, "help": "folder that gets a copy of every table that diagnose missed"},
    minutes={"type": float, "default": np.inf, "help": "begin no table after so many"},
)
def main(chosen: Namespace) -> None:
    """Read the options, process the tables, and print the results."""
    begun, tasks = time.perf_counter(), _tasks(chosen)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    known = [task for task in tasks if task.kept.exists()]
    results: dict[str, list[dict[str, object]]] = {row: [] for row in chosen.rows}
    for task in known:
        results[task.row].append(marked(task))
    asked = [task for task in tasks if task not in known and chosen.minutes > 0]
    found = answers(guarded, asked, chosen.jobs, chosen.minutes, chosen.scheduler)
    for done, (task, result) in enumerate(found, 1):
        results[task.row].append(result)
        _tell(task, result, chosen.misses)
        if done % 10 == 0:
            print(f"   {done} of {len(asked)} tables, {time.perf_counter() - begun:.0f} s", flush=True)
    print("\n".join(report_of(results)))
    print(f"seed {chosen.seed}, {time.perf_counter() - begun:.0f} s")
