"""Thread priority for the measurement on a computer that is busy with other programs."""

import os
import sys
from contextlib import suppress

# Longest time that a thread waits for Python's global interpreter lock when it returns from compiled code. The
# measurement returns many times per frame, so that Python's default of 5 ms would add up to several frames while a page
# is drawn.
SWITCH_S = 0.0005
# Higher priority than that of a user's programs, but lower than that of the system's processes.
NICENESS = -10


def be_prompt() -> None:
    """Raise the priority of the calling thread, and of threads that it starts, so that frames are measured on time.

    All threads that run Python code should call this function, because a thread that waits for Python's global
    interpreter lock is delayed by the thread that has the lock. The priority is raised only for users with permission
    (root, or a limit set with ulimit -e).
    """
    sys.setswitchinterval(SWITCH_S)
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)  # on Linux, process 0 means the calling thread
