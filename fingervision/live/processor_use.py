"""Processor time of a thread and of the process: used, or waited for while other threads and programs had it."""

from pathlib import Path
from time import process_time, thread_time

# Of each thread: nanoseconds on a processor, nanoseconds ready to run without one (Linux, Documentation/scheduler/
# sched-stats.rst).
TASKS, SCHEDULED = Path("/proc/self/task"), Path("/proc/thread-self/schedstat")


def of_this_thread_s() -> float:
    """Processor time (s) that the calling thread has used or waited for; the waits are known on Linux only."""
    return thread_time() + _waited_s(SCHEDULED)


def of_process_s() -> float:
    """Processor time (s) that all threads of this process have used or waited for."""
    return process_time() + sum(map(_waited_s, TASKS.glob("*/schedstat")))


def _waited_s(file: Path) -> float:
    try:
        return 1e-9 * int(file.read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
