"""Run `fingervision diagnose`, the public command, on files; its result is read from report.json."""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from click.testing import CliRunner


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer of a method for a table.

    Parameters
    ----------
    verdict : str
        `agrees`, `named`, `ambiguous`, `unknown`, or `failed`.
    sets : tuple of frozenset of str
        All stated explanations, the best one first; empty for `agrees` and `unknown`.
    seconds : float
        Wall time.
    report : dict
        Content of report.json, if there is one.
    """

    verdict: str
    sets: tuple[frozenset[str], ...]
    seconds: float
    report: dict[str, Any]


def read_report(path: Path, seconds: float) -> Answer:
    """Read a report.json."""
    report = json.loads(path.read_text(encoding="utf-8"))
    best = frozenset(effect["name"] for effect in report["effects"])
    sets = [frozenset(names) for names in report.get("alternatives") or []]
    answered = report["verdict"] in ("named", "ambiguous")
    sets = [best, *[s for s in sets if s != best]] if answered else []
    return Answer(report["verdict"], tuple(sets), seconds, report)


def diagnose(folder: Path, seed: int = 1) -> Answer:
    """Run `fingervision diagnose` on a folder's measured.csv and simulation.csv."""
    from fingervision.cli import cli  # the tool is loaded only where it is asked

    out = folder / "diagnosis"
    begun = time.perf_counter()
    files = [str(folder / "measured.csv"), "--model", str(folder / "simulation.csv"), "--out", str(out)]
    done = CliRunner().invoke(cli, ["diagnose", *files, "--seed", str(seed)])
    seconds = time.perf_counter() - begun
    if done.exit_code != 0 or not (out / "report.json").exists():
        said = done.output[-400:] + (repr(done.exception) if done.exception else "")
        return Answer("failed", (), seconds, {"said": said, "exit_code": done.exit_code})
    return read_report(out / "report.json", seconds)
