"""Add the drive's input to a finished table of gaps, once the offset between the clocks is known."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.measuring.series import GapSeries
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.motion.drive_at import DriveState, drive_at
from fingervision.storage.gaps_csv import with_drive

NOTHING_STATED: Mapping[str, Any] = MappingProxyType({"drive_offset": None, "u_drive_offset_s": None})


def clock_of(series: GapSeries, drive: DriveHistory) -> ClockOffset | NoClockOffset:
    """Find the offset of the drive's clock, from all frames with a gap and a time."""
    times = series.times_s()
    if times is None:
        return NoClockOffset("the recording has no times: give --rate-hz, or a times.csv beside the images.")
    # Imported here, because the import is slow and only needed with a drive.
    from fingervision.motion.clock.alignment import find_clock_offset

    return find_clock_offset(times[0], series.gap_mm, drive)


def join_drive(table: Path, drive: DriveHistory, clock: ClockOffset) -> bool:
    """Write the drive's input at each frame into a table of gaps; return whether any frame received an input.

    Raises
    ------
    OutputError
        If the table cannot be rewritten; the old table is then unchanged.
    """
    joined: list[bool] = []

    def state(time_s: float) -> DriveState | None:
        found = drive_at(drive, clock.log_time_s(time_s))
        joined.append(found is not None)
        return found

    with_drive(table, state, has_force=drive.force_n is not None)
    return any(joined)


def in_words(clock: ClockOffset | NoClockOffset | None, given_s: float | None) -> dict[str, Any]:
    """Describe the clock offset (found, given, or neither) for the settings in the summary."""
    if isinstance(clock, ClockOffset):
        return {
            "drive_offset": "found",
            "drive_offset_s": clock.offset_s,
            "u_drive_offset_s": clock.u_offset_s,
            "drive_offset_at_s": clock.reference_s,
            "drive_clock_rate": clock.rate,
            "u_drive_clock_rate": clock.u_rate,
            "u_drive_time_s": clock.u_time_s,
            "drive_play_mm": clock.play_mm,
            "u_drive_play_mm": clock.u_play_mm,
            "drive_corner_s": clock.corner_s,
            "u_drive_corner_s": clock.u_corner_s,
            "drive_explained_share": clock.explained_share,
            "drive_runner_up_s": clock.runner_up_s,
        }
    if isinstance(clock, NoClockOffset):
        return {
            **NOTHING_STATED,
            "drive_offset": "not found",
            "drive_offset_s": None,
            "drive_offset_candidates_s": list(clock.candidates_s),
        }
    given = None if given_s is None else "given"
    return {**NOTHING_STATED, "drive_offset": given, "drive_offset_s": given_s}


def sentence(clock: ClockOffset) -> str:
    """Sentence that states the clock offset and its expanded uncertainty."""
    return (
        f"Clock offset: {clock.offset_s:.4f} s, U = {2.0 * clock.u_offset_s:.2g} s (k = 2), found from the motion; "
        "the offset was added to the drive's times. The offset includes a constant lag of the gap. This U applies to "
        f"the drive's first row; over all frames, with the clocks' rates, U = {2.0 * clock.u_time_s:.2g} s."
    )


def refusal(found: NoClockOffset, where: str) -> DataError:
    """Error that states why the rows have no input; `where` names the table of gaps (`in measured/run/gaps.csv`)."""
    return DataError(
        f"The offset between the recording's clock and the drive's was not found: {found.words} The gaps are {where}, "
        "without an input; state the offset by --drive-offset-s S (0 if both have the same clock)."
    )
