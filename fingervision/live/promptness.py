"""Numbers first, on a machine that is busy with other things."""

import os
import sys
from contextlib import suppress

# While one thread runs Python, others that have come back from compiled code wait for it so long. Measuring comes back
# many times a frame, so Python's usual 5 ms add up to several frames when the page is drawn meanwhile.
SWITCH_S = 0.0005
# Before what people run on a desk; the system's own work stays before it.
NICENESS = -10


def be_prompt() -> None:
    """Let this thread, and those that it starts, be served soon.

    All threads that run Python should ask for it: who waits for Python's lock waits for whoever holds it. The priority
    is given to those alone who may ask for it (root, or a limit set with ulimit -e); others go on as they are.
    """
    sys.setswitchinterval(SWITCH_S)
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)  # on Linux that is this thread
