"""The one door to the tool: a process a table, files in, report.json out, through the public command."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

COMMAND = (sys.executable, "-c", "from fingervision.cli import main; main()")
"""The public command of this tree, whatever is installed."""
LONGEST_S = 240.0
"""As score.py of the real rigs."""


def ask(folder: Path, out: Path, *, again: bool = False) -> dict[str, Any]:
    """Diagnose a folder's table; the answer is kept under `out` and taken from there the next time."""
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
