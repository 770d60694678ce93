"""Thread priority for the measurement, on a machine that is busy with other programs."""

import os
import sys
from contextlib import suppress

# While one thread runs Python, others that have come back from compiled code wait for it so long. Measuring comes back
# many times a frame, so Python's usual 5 ms add up to several frames when the page is drawn meanwhile.
SWITCH_S = 0.0005
# Before what people run on a desk; the system's own work stays before it.
NICENESS = -10


def be_prompt() -> None:
    """Raise the priority of this thread, and of those that it starts.

    All threads that run Python should call it, because a thread that waits for Python's lock waits for the thread that
    holds it. Only users with permission (root, or a limit set with ulimit -e) get the priority; for others nothing
    changes.
    """
    sys.setswitchinterval(SWITCH_S)
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)  # on Linux that is this thread
