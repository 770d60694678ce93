"""State of the drive (input, run, force) at the time of a frame."""

from dataclasses import dataclass

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.measuring.drive_jumps import jumps


@dataclass(frozen=True, slots=True)
class DriveState:
    """Recorded input, run and force at one instant.

    Parameters
    ----------
    run : str
        Name of the run; empty where the drive table has no runs.
    input_mm : float
        Input displacement.
    force_n : float or None
        Force at the drive, where it was recorded.
    """

    run: str
    input_mm: float
    force_n: float | None


def drive_at(drive: DriveHistory, time_s: float) -> DriveState | None:
    """Interpolate the drive linearly between the two samples that bracket an instant.

    Nothing is extrapolated: before the first sample, after the last sample, and between two runs the function returns
    no input. It returns none either where the log jumps from one place of rest to another, because the place in between
    is not known.

    Parameters
    ----------
    drive : DriveHistory
        Drive history whose times increase over the whole table.
    time_s : float
        Time on the drive's clock.

    Returns
    -------
    DriveState or None
        None if no run brackets the instant, or if the log jumps there.
    """
    after = int(np.searchsorted(drive.time_s, time_s, side="left"))
    if after == drive.time_s.size:
        return None
    if drive.time_s[after] == time_s:
        before = after
    elif after == 0:
        return None
    else:
        before = after - 1
    run = ("", "") if drive.run is None else (drive.run[before], drive.run[after])
    if run[0] != run[1]:
        return None
    if before != after and jumps(drive)[before]:
        return None
    start_s, end_s = float(drive.time_s[before]), float(drive.time_s[after])
    share = 0.0 if before == after else (time_s - start_s) / (end_s - start_s)
    force_n = None
    if drive.force_n is not None:
        force_n = float((1.0 - share) * drive.force_n[before] + share * drive.force_n[after])
    return DriveState(run[0], float((1.0 - share) * drive.input_mm[before] + share * drive.input_mm[after]), force_n)
