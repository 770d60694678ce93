"""Run `fingervision diagnose`, the public command, in one process per table; its result is read from report.json."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

COMMAND = (sys.executable, "-c", "from fingervision.cli import main; main()")
"""Public command of this source tree, independent of the installed version."""
LONGEST_S = 240.0
"""Time limit, as in score.py for measured tables."""


def ask(folder: Path, out: Path, *, again: bool = False) -> dict[str, Any]:
    """Diagnose the table of a folder; the answer is stored in `out` and read from there the next time."""
    kept = out / "answer.json"
    if kept.exists() and not again:
        return dict(json.loads(kept.read_text(encoding="utf-8")))
    out.mkdir(parents=True, exist_ok=True)
    files = [str(folder / "measured.csv"), "--model", str(folder / "simulation.csv"), "--out", str(out / "diagnosis")]
    begun = time.perf_counter()
    answer: dict[str, Any] = {"report": None, "said": ""}
    try:
        done = subprocess.run([*COMMAND, "diagnose", *files], capture_output=True, text=True, timeout=LONGEST_S)
        answer |= {"exit_code": done.returncode, "said": (done.stdout + done.stderr)[-2000:]}
        report = out / "diagnosis" / "report.json"
        if done.returncode in (0, 3) and report.exists():
            answer["report"] = json.loads(report.read_text(encoding="utf-8"))
    except subprocess.TimeoutExpired:
        answer |= {"exit_code": None, "said": f"no answer within {LONGEST_S:.0f} s"}
    answer["seconds"] = time.perf_counter() - begun
    kept.write_text(json.dumps(answer), encoding="utf-8")
    return answer
