"""Work in a process of its own, so that the threads of this one go on, and that process's libraries are its own."""

import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
PROGRAM = "import sys; sys.path[:] = {path!r}; from fingervision.domain.own_process import serve; serve()"


def in_own_process(work: Callable[[*Ts], T], *given: *Ts) -> T:
    """Call a function in another process; in this one if no other can be started or the function fails there.

    See `called_apart`.
    """
    try:
        return called_apart(work, *given)
    except (OSError, subprocess.SubprocessError):  # no memory for a second process, or no interpreter
        return work(*given)


def called_apart(work: Callable[[*Ts], T], *given: *Ts) -> T:
    """Call a function in another process.

    Parameters
    ----------
    work : callable
        A function of a module.
    *given
        What it is called with; as its result, it must pickle.

    Raises
    ------
    OSError
        No other process can be started.
    subprocess.CalledProcessError
        The function raised an exception, or the process crashed.
    """
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(path=sys.path)],
        input=pickle.dumps((work, given)),
        capture_output=True,
        check=True,
        # Ctrl-C in the terminal is for this process, which may still complete a run.
        start_new_session=True,
    )
    answer: T = pickle.loads(done.stdout)  # of this program's own process, from a private pipe
    return answer


def serve() -> None:
    """In the other process: read function and arguments from standard input and write the result to standard output."""
    work, given = pickle.load(sys.stdin.buffer)
    sys.stdout.buffer.write(pickle.dumps(work(*given)))
