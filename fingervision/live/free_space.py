"""Time for which the disk space suffices for a recording at its present data rate (minutes)."""

import shutil
from pathlib import Path

# Shorter or smaller recordings give no data rate: the first frames differ in size, and the file is buffered.
LEAST_S, LEAST_BYTES = 2.0, 1_000_000


def minutes_left(folder: Path, seconds: float) -> float | None:
    """Minutes until the disk of a recording is full; None until the data rate is known.

    Parameters
    ----------
    folder : Path
        Folder of the recording.
    seconds : float
        Duration of the recording so far.
    """
    try:
        written = sum(file.stat().st_size for file in folder.iterdir())
        free = shutil.disk_usage(folder).free
    except OSError:
        return None
    if seconds < LEAST_S or written < LEAST_BYTES:
        return None
    return free / (written / seconds) / 60.0
