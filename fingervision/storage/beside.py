"""What summary.json, run.json and gaps.csv say of the table or recording beside which they lie.

These files are optional: a folder without them, or one of another program, says nothing, and that is no error.
"""

import statistics
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import Origin
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError
from fingervision.domain.measured_table import ONE_CLOCK, FoundClock, ReferenceSlot
from fingervision.motion.drive_at import drive_at
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.drive_csv import DRIVE_LOG, read_drive
from fingervision.storage.gaps_csv import MM_PLACES, TIME_PLACES
from fingervision.storage.plain_file import json_of
from fingervision.storage.run_files import RUN
from fingervision.storage.summary_json import GAPS, SUMMARY

SLOTS = "reference_slots"
"""Key of run.json for the reference slots that were measured in a run on the test bed."""


def optional_document(path: Path) -> dict[str, Any]:
    """Content of a JSON document; empty if there is none."""
    try:
        found = json_of(path)
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def measurement_beside(table: Path) -> Mapping[str, Any]:
    """Content of the summary beside a gaps.csv; empty for any other table."""
    return optional_document(table.parent / SUMMARY) if table.name == GAPS else {}


def clock_beside(table: Path) -> FoundClock:
    """What was found about the clocks of gap and drive, from the summary beside a gaps.csv.

    Parameters
    ----------
    table : Path
        A gaps.csv, or any other table.

    Returns
    -------
    FoundClock
        One clock for any other table, or if the offset was given instead of estimated.
    """
    try:
        settings = measurement_beside(table)["settings"]
        if settings["drive_offset"] != "found":
            return ONE_CLOCK
        u_s = float(settings["u_drive_time_s"])
        # Summaries of older versions state no corners.
        corner_s, u_corner_s = (float(settings.get(name, 0.0)) for name in ("drive_corner_s", "u_drive_corner_s"))
    except (ValueError, LookupError, TypeError):
        return ONE_CLOCK
    known = 0.0 < u_s < float("inf") and 0.0 <= corner_s < float("inf") and 0.0 <= u_corner_s < float("inf")
    return FoundClock(u_s, corner_s, u_corner_s) if known else ONE_CLOCK


def log_beside(
    table: Path, time_s: NDArray[np.float64] | None, input_mm: NDArray[np.float64], runs: Collection[str]
) -> DriveHistory | None:
    """The drive's log on the recording's clock, beside a gaps.csv whose inputs were read from it.

    Parameters
    ----------
    table : Path
        A gaps.csv, or any other table.
    time_s, input_mm : ndarray of float, shape (n,)
        Times and inputs of the table; None without times.
    runs : collection of str
        Names of its runs.

    Returns
    -------
    DriveHistory or None
        None for any other table, or if an input of the table is not that of the log.
    """
    file = table.parent / DRIVE_LOG
    if table.name != GAPS or time_s is None or not file.is_file():
        return None
    try:
        log = read_drive(file)
    except FingervisionError:
        return None
    if log.run is not None and not set(runs) <= set(log.run):
        return None
    states = [drive_at(log, at_s) for at_s in time_s.tolist()]
    read_mm = np.array([np.inf if state is None else state.input_mm for state in states])
    speeds = np.abs(np.diff(log.input_mm)) / np.maximum(np.diff(log.time_s), 10.0**-TIME_PLACES)
    rounding_mm = 10.0**-MM_PLACES + 10.0**-TIME_PLACES * float(speeds.max(initial=0.0))
    return log if np.all(np.abs(read_mm - input_mm) <= rounding_mm) else None


def response_note(summary: Mapping[str, Any], shifts_px: Iterable[float]) -> tuple[str, ...]:
    """Sentence that the camera's response was assumed, and by how much this assumption may shift the gap.

    An error of the response moves both edges equally in every frame, so that it has the signature of an offset.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    shifts_px : iterable of float
        Values of the column u_shift_px of gaps.csv.

    Returns
    -------
    tuple of str
        One sentence if the summary says that the response is not known; none otherwise.
    """
    try:
        settings, px_per_mm = summary["settings"], float(summary["scale"]["px_per_mm"])
        is_known, response = settings.get("response_known", True), settings["response"]
    except (LookupError, TypeError, ValueError, AttributeError):
        return ()
    if is_known is not False or not px_per_mm > 0.0:
        return ()
    found = list(shifts_px)
    size = ""
    if found and statistics.median(found) > 0.0:
        size = f" by up to {1e3 * statistics.median(found) / px_per_mm:.2g} um (u_shift_px, median)"
    if _origin(summary) == Origin.LEARNT:
        return (f"the camera's response was learnt from the recording as {response}{_open(found, px_per_mm)}.",)
    return (
        f"the camera's response is not known and was taken as {response}: another usual response may change all gaps "
        f"equally{size}, like an offset; measure the response with `fingervision calibrate response`.",
    )


def _origin(summary: Mapping[str, Any]) -> object:
    try:
        return summary["camera"]["response"]["origin"]
    except (LookupError, TypeError):
        return None


def _open(shifts_px: list[float], px_per_mm: float) -> str:
    if not shifts_px:
        return ""
    return f"; with what lies beside the edges, this leaves {2e3 * statistics.median(shifts_px) / px_per_mm:.2g} um (U)"


def response_note_beside(table: Path) -> tuple[str, ...]:
    """Sentence that the response was assumed, for a gaps.csv with its summary.json; none for other tables."""
    if not (summary := measurement_beside(table)):
        return ()
    try:
        shifts = read_columns(table, (), ("u_shift_px",))
        found = shifts.numbers("u_shift_px") if "u_shift_px" in shifts else None
    except FingervisionError:
        return ()
    return response_note(summary, [] if found is None else found.value[found.present].tolist())


def slots_beside(table: Path) -> tuple[ReferenceSlot, ...]:
    """Read the reference slots of the run to which a table belongs; empty without a run or without measured slots."""
    about = optional_document(table.parent / RUN)
    try:
        listed = about.get(SLOTS, []) if table.name in (about["samples"], about.get("joined")) else []
        return tuple(
            ReferenceSlot(*(float(slot[key]) for key in ("size_mm", "u_size_mm", "measured_mm", "u_random_mm")))
            for slot in listed
        )
    except (ValueError, LookupError, TypeError):
        return ()


def recorded_camera(files: Sequence[Path]) -> Mapping[str, str]:
    """Read the camera's settings at the time of a recording that consists of given files; empty without a run.json."""
    about = optional_document(files[0].parent / RUN) if len(files) == 1 else {}
    try:
        camera = about["device"]["camera"] if about["video"] == files[0].name else {}
    except (LookupError, TypeError):
        return {}
    return {str(name): str(value) for name, value in camera.items()} if isinstance(camera, dict) else {}
