"""How long the disk lasts for a recording at the rate at which it has grown so far."""

import shutil
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fingervision.live.recorder import Recorder

# The first frames' sizes say little, and the file is buffered.
LEAST_S, LEAST_BYTES = 2.0, 1_000_000


def minutes_left(recorder: "Recorder") -> float | None:
    """Minutes until the recording's disk is full; None as long as its rate is not known.

    Parameters
    ----------
    recorder : Recorder
        The recording under way.
    """
    try:
        written = sum(file.stat().st_size for file in recorder.run.path.iterdir())
        free = shutil.disk_usage(recorder.run.path).free
    except OSError:
        return None
    seconds = monotonic() - recorder.began_s
    if seconds < LEAST_S or written < LEAST_BYTES:
        return None
    return free / (written / seconds) / 60.0
