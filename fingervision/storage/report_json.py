"""The file report.json of a diagnosis."""

import json
from dataclasses import asdict
from pathlib import Path

from fingervision.domain.report import DiagnosisReport, NamedEffect


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
