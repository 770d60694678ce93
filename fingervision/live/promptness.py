"""Thread priority for the measurement on a computer that is busy with other programs."""

import os
import sys
from contextlib import suppress

# While one thread runs Python, others that have come back from compiled code wait for it so long. Measuring comes back
# many times a frame, so Python's usual 5 ms add up to several frames when the page is drawn meanwhile.
SWITCH_S = 0.0005
# Before what people run on a desk; the system's own work stays before it.
NICENESS = -10


def be_prompt() -> None:
    """Raise the priority of the calling thread, and of threads that it starts, so that frames are measured on time.

    All threads that run Python code should call this function, because a thread that waits for Python's global
    interpreter lock depends on the thread that holds it. The priority is raised only for users with permission (root,
    or a limit set with ulimit -e).
    """
    sys.setswitchinterval(SWITCH_S)
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)  # on Linux that is this thread
