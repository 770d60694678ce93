"""The files summary.json of a measurement and report.json of a diagnosis."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fingervision.domain.errors import UsageError
from fingervision.domain.report import DiagnosisReport, NamedEffect
from fingervision.storage.durable import written
from fingervision.storage.plain_file import json_of

SUMMARY = "summary.json"
GAPS = "gaps.csv"
SCHEMA = 1


def write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the summary; an older summary is replaced only once the new file is complete.

    Parameters
    ----------
    path : Path
        The file.
    summary : mapping
        Content of the file: text, numbers, None, lists and mappings, without NaN.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with written(path, "free disk space or name another folder with --out, and measure again") as part:
        # A file name that is not valid UTF-8 is written with JSON escapes.
        part.write_text(summary_text(summary), encoding="utf-8", errors="backslashreplace")


def summary_text(summary: Mapping[str, Any]) -> str:
    """Return the text of the file summary.json."""
    return json.dumps({"schema": SCHEMA, **summary}, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def recording_of(folder: Path) -> str | None:
    """Name of the recording to which the results in a folder belong; None without a summary."""
    try:
        name = json_of(folder / SUMMARY)["recording"]["name"]
    except (OSError, ValueError, LookupError, TypeError):
        return None
    return name if isinstance(name, str) else None


def refuse_other_recording(folder: Path, recording: str) -> None:
    """Refuse an output folder that holds the results of another recording.

    Parameters
    ----------
    folder : Path
        Folder for the new results.
    recording : str
        The recording as named by the user: a file, a folder or a pattern.

    Raises
    ------
    UsageError
        The folder holds the results of another recording.
    """
    of = recording_of(folder)
    if of is None or Path(of).resolve() == Path(recording).resolve():
        return
    # A name may be relative to the folder of an earlier call; its last part is then compared.
    if not Path(of).exists() and Path(of).name == Path(recording).name:
        return
    raise UsageError(f"--out must be a folder of its own, but {folder} holds the results of {of}: name another folder.")


# The file report.json of a diagnosis.


def report_document(report: DiagnosisReport, model_path: str | None, recipe_path: str | None) -> dict[str, object]:
    """Compose the content of report.json; paths are relative to the folder of the report."""
    run = report.next_run
    return {
        "schema": 1,
        "verdict": str(report.verdict),
        "sentence": report.sentence,
        "effects": [_effect(effect) for effect in report.effects],
        "alternatives": [list(names) for names in report.alternatives],
        "where": [
            {
                "channel": place.channel,
                "variable": place.variable,
                "from": place.start,
                "to": place.end,
                "size": place.size,
                "unit": place.unit,
                "sigma": place.sigma,
                "words": place.words,
            }
            for place in report.where
        ],
        "disagreement": asdict(report.disagreement),
        "explained_share": report.explained_share,
        "standing_share": report.standing_share,
        "pure_error_mm": report.pure_error_mm,
        "smallest_seen": report.smallest_seen,
        "unknown": report.unknown,
        "remaining": report.remaining,
        "next_run": None
        if run is None
        else {
            "recipe": recipe_path,
            "promised": {"gain": run.gain, "from": run.gain_interval[0], "to": run.gain_interval[1]},
            "separates": list(run.separates),
            "words": run.words,
        },
        "next_step": report.next_step,
        "excluded": list(report.excluded),
        "outliers": list(report.outliers),
        "outlier_rows": [dict(row) for row in report.outlier_rows],
        "runners_up": list(report.runners_up),
        "notes": list(report.notes),
        "model": model_path,
        "seconds": report.seconds,
    }


def _effect(effect: NamedEffect) -> dict[str, object]:
    """Convert an effect to a mapping for JSON, with its place, its end, one-sided limits and its curve, if any."""
    document = asdict(effect)
    for parameter in document["parameters"].values():
        for limit in ("at_least", "at_most"):
            if parameter[limit] is None:
                del parameter[limit]
    points = document.pop("points")
    for name in ("place", "end"):
        if not document[name]:
            del document[name]
    return {**document, "points": [list(point) for point in points]} if points else document


def write_report(path: Path, document: dict[str, object]) -> None:
    """Write the report as JSON, which never contains NaN."""
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
