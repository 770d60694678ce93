"""Diagnose simulated tables, and print a table of marks.

    python -m tests.benchmarks.world.run --seed 1 --tables 20 --rows iso_cycles,sparse --jobs 2 --minutes 30

Tables and answers are stored under --out, so that a run may be stopped and continued. With --minutes 0 the stored
results are printed; with --again the diagnoses are repeated. With --tables-from DIR the tables of another folder are
used. Seeds below 1000 are for development, other seeds for results.
"""

import json
import os
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.frame import Namespace, answers, benchmark, listed
from tests.benchmarks.hidden.binomial import Rate
from tests.benchmarks.world.ask import ask
from tests.benchmarks.world.draw import draw_table
from tests.benchmarks.world.marks import COVERAGE_FACTOR, Marker
from tests.benchmarks.world.rows.catalogue import ENCODER_KINDS, ROWS

Result = dict[str, Any]
NAMES = ("named", "ambiguous")


def work(task: tuple[str, int], seed: int, tables: Path, answers: Path, again: bool, kept_only: bool) -> Result | None:
    """Draw, diagnose and mark one table; None if only stored answers are requested and there is none."""
    row, index = task
    folder, out = tables / f"{row}_{index}", answers / f"{row}_{index}"
    if kept_only and not (out / "answer.json").exists():
        return None
    draw_table(row, seed, index, tables)
    answer = ask(folder, out, again=again)
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    report = answer["report"]
    mark = Marker(truth).mark(report, answer["exit_code"])
    said = "no report" if report is None else report["verdict"]
    sets = [] if report is None else [[e["name"] for e in report["effects"]], *(report.get("alternatives") or [])]
    return {
        "row": row, "index": index, "kind": truth["kind"], "hidden": [h["name"] for h in truth["hidden"]],
        "outside": bool(truth["outside_structure"]), "verdict": said, "sets": ["+".join(s) for s in sets],
        "seconds": answer["seconds"], "said": answer["said"], **asdict(mark),
    }  # fmt: skip


def row_lines(row: str, found: list[Result]) -> list[str]:
    """Lines with the results of a row."""
    null = [r for r in found if not r["hidden"] and not r["outside"]]
    inside = [r for r in found if r["hidden"] and not r["outside"]]
    outside = [r for r in found if r["outside"]]

    def count(of: list[Result], *results: str) -> Rate:
        return Rate(sum(r["result"] in results for r in of), len(of))

    lines = [f"{row} ({len(found)} tables)"]
    if null:
        lines.append(f"    null: claims {count(null, 'claim')}")
    for title, few in (("one effect", [r for r in inside if len(r["hidden"]) == 1]),
                       ("more effects", [r for r in inside if len(r["hidden"]) > 1])):  # fmt: skip
        if few:
            lines.append(f"    {title}: exact or set with the truth {count(few, 'exact', 'set', 'right')}, exact "
                         f"{count(few, 'exact').hits}, part {count(few, 'part').hits}, unknown "
                         f"{count(few, 'unknown').hits}")  # fmt: skip
    bar = [r for r in inside if r["row"] == "encoder_bar" or r["row"] in ENCODER_KINDS]
    if bar:
        among = sum(any("backlash" in s.split("+") for s in r["sets"]) and r["verdict"] in NAMES for r in bar)
        lines.append(f"    play behind an encoder: backlash named or in the set {Rate(among, len(bar))}")
    if inside:
        lines.append(f"    wrong {count(inside, 'wrong')}; false agrees {count(inside, 'false agrees')}")
    if outside:
        lines.append(f"    outside: unknown {count(outside, 'right')}, exchangeable {count(outside, 'set').hits}, "
                     f"part {count(outside, 'part').hits}, wrong {count(outside, 'wrong').hits}, false agrees "
                     f"{count(outside, 'false agrees').hits}")  # fmt: skip
    signs = [r["sign_said"] for r in found if r["sign_said"] is not None]
    if signs:
        lines.append(f"    the wrong sign is said {Rate(sum(signs), len(signs))}")
    near = [abs(v) <= COVERAGE_FACTOR for r in found for v in r["deviations"].values()]
    if near:
        lines.append(f"    95 % intervals cover {Rate(sum(near), len(near))}")
    sized = [ok for r in found for ok in r["sizes"].values()]
    if sized:
        lines.append(f"    sizes within their tolerance {Rate(sum(sized), len(sized))}")
    leaves, lost = sum(r["leaves"] for r in found), sum(r["result"] == "no report" for r in found)
    if leaves or lost:
        lines.append(f"    names that leave too much standing {leaves}; no report {lost}")
    return lines


def summary(found: list[Result]) -> list[str]:
    """Summary of all rows, compared with the required values."""
    lines = ["all rows", *row_lines("all", found)[1:]] if found else ["no answers"]
    seconds = [r["seconds"] for r in found]
    if seconds:
        lines.append(f"    seconds a table, start of the command included: median {np.median(seconds):.1f}, "
                     f"largest {max(seconds):.1f}")  # fmt: skip
    return lines


def tell(r: Result) -> None:
    """Line that describes an answer that is not right."""
    if r["result"] in ("right", "exact", "set"):
        return
    hidden = "+".join(r["hidden"]) or ("outside" if r["outside"] else "-")
    last = r["said"].strip().splitlines()[-1:] if r["result"] == "no report" else ""
    print(f"   {r['row']}_{r['index']} ({r['kind']}): hidden {hidden}; {r['verdict']} {r['sets'][:4]} -> {r['result']}"
          f"{', leaves too much' if r['leaves'] else ''} {last or ''}", flush=True)  # fmt: skip


@benchmark(
    seed=1,
    tables={"type": int, "default": 6, "help": "tables a row"},
    first={"type": int, "default": 0, "help": "number of the first table"},
    rows={**listed([*ROWS, *ENCODER_KINDS, "encoder_kinds"]), "default": list(ROWS)},
    jobs=2,
    minutes={"type": float, "default": np.inf, "help": "begin no table after so many"},
    out=Path("results/world"),
    tables_from={"type": Path, "help": "folder with the drawn tables"},
    answers={"default": "answers", "help": "name under which the answers are kept"},
    again={"action": "store_true", "help": "ask anew"},
)
def main(chosen: Namespace) -> None:
    """Read the options, process the tables, and print the results."""
    rows = list(ENCODER_KINDS) if chosen.rows == ["encoder_kinds"] else chosen.rows
    base = chosen.out.absolute() / f"seed{chosen.seed}"
    tables = chosen.tables_from.absolute() if chosen.tables_from else base / "tables"
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    begun, found = time.perf_counter(), list[Result]()
    # All rows are processed in turn, so that an interrupted run has equal numbers of tables for each row.
    tasks = [(row, index) for index in range(chosen.first, chosen.first + chosen.tables) for row in rows]
    asked = partial(
        work,
        seed=chosen.seed,
        tables=tables,
        answers=base / chosen.answers,
        again=chosen.again,
        kept_only=chosen.minutes == 0,
    )
    for _, result in answers(asked, tasks, chosen.jobs, chosen.minutes or np.inf):
        if result is not None:
            found.append(result)
            tell(result)
    for row in rows:
        print("\n".join(row_lines(row, [r for r in found if r["row"] == row])))
    print("\n".join(summary(found)))
    print(f"seed {chosen.seed}, {time.perf_counter() - begun:.0f} s")
