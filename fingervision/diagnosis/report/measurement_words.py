"""Sentences on the clocks and the gap's uncertainty, from the summary of a measured table."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR
from fingervision.storage.summary_json import measurement_beside


def measurement_words(table: Path) -> list[str]:
    """Sentences on clocks and uncertainty of a measured table; none if its folder has no summary of a measurement."""
    summary = measurement_beside(table)
    try:
        return [*_clock(summary["settings"]), *_uncertainty(summary)] if summary else []
    except (LookupError, TypeError, ValueError, AttributeError):
        # A summary of another version, or one that was edited, may lack these entries.
        return []


def _clock(settings: Mapping[str, Any]) -> list[str]:
    """State the offset between the clocks, with its expanded uncertainty."""
    if settings.get("drive_offset") == "given":
        return [f"Clock offset: {settings['drive_offset_s']:.4f} s, as given; it was added to the drive's times."]
    if settings.get("drive_offset") != "found":
        return []
    first, over = (COVERAGE_FACTOR * float(settings[key]) for key in ("u_drive_offset_s", "u_drive_time_s"))
    return [
        f"Clock offset, found from the motion and added to the drive's times: {settings['drive_offset_s']:.4f} s, "
        f"U = {first:.2g} s at the drive's first row, U = {over:.2g} s over the frames (k = 2)."
    ]


def _uncertainty(summary: Mapping[str, Any]) -> list[str]:
    """State the gap's uncertainty: its random part, the systematic parts that are known, and what is not included."""
    gap, budget = summary["gap"], summary["uncertainty"]
    words = f"Standard uncertainty of a gap reading (median): {gap['median_u_random_mm']:.2g} mm random"
    whole = gap["median_u_gap_mm"]
    words += (
        "; the uncertainty of the scale is not known" if whole is None else f", {whole:.2g} mm with the calibration"
    )
    shared = [f"{part['source']} {part['rms_u_mm']:.2g} mm" for part in budget["parts"] if part["kind"] == "shared"]
    words += f". Equal in every reading: {'; '.join(shared)}" if shared else ""
    lacks = [str(item) for item in budget["not_included"]]
    return [f"{words}.", *([f"Not included: {'; '.join(lacks)}."] if lacks else [])]
