"""How long the disk space suffices for a recording at its present rate."""

import shutil
from pathlib import Path

# The first frames' sizes say little, and the file is buffered.
LEAST_S, LEAST_BYTES = 2.0, 1_000_000


def minutes_left(folder: Path, seconds: float) -> float | None:
    """Minutes until a recording's disk is full; None until its rate is known.

    Parameters
    ----------
    folder : Path
        The recording's.
    seconds : float
        How long it has been written.
    """
    try:
        written = sum(file.stat().st_size for file in folder.iterdir())
        free = shutil.disk_usage(folder).free
    except OSError:
        return None
    if seconds < LEAST_S or written < LEAST_BYTES:
        return None
    return free / (written / seconds) / 60.0
