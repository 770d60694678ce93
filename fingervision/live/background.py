"""Execution of a fingervision command in a separate process of low priority, so that the live view is not slowed."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Event

from fingervision.domain.errors import ProcessError

LOWEST = 19
"""Niceness of a command that runs beside a camera: the command gets only processor time that no other program needs."""
WAITED_FOR = 5
"""Niceness of a command whose result a user awaits while no camera runs. Such a command gets a third of the processor
time that a busy program gets. At `LOWEST`, a seventieth of it, a recording of one second was not measured within two
minutes at a load of 24.
"""
# Threads of the live view have a raised priority (see `promptness`), which a process inherits from the thread that
# starts it.
BEGIN = (
    "import os, sys\n"
    "if hasattr(os, 'setpriority'):\n"
    "    os.setpriority(os.PRIO_PROCESS, 0, max({niceness}, os.getpriority(os.PRIO_PROCESS, 0)))\n"
    "from fingervision.cli import main\n"
    "sys.argv[0] = 'fingervision'\n"
    "main()\n"
)
ENDS_WITHIN_S = 5.0
LOOK_EVERY_S = 0.1
# Without these limits, the numerical libraries would use all cores.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


class BackgroundCommand:
    """One execution of a fingervision command.

    Parameters
    ----------
    *arguments : str or Path
        Command-line arguments, as written after `fingervision`.
    niceness : int, optional
        Niceness of the process: `LOWEST` or `WAITED_FOR`.

    Raises
    ------
    FingervisionError
        No process can be started.
    """

    def __init__(self, *arguments: str | Path, niceness: int = LOWEST) -> None:
        root = str(Path(__file__).parents[2])
        paths = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH", ""))))
        try:
            self._folder = tempfile.TemporaryDirectory(prefix="fingervision_")
            self._out, self._error = (Path(self._folder.name) / name for name in ("out", "error"))
            with self._out.open("w") as out, self._error.open("w") as error_stream:
                self._process = subprocess.Popen(
                    [sys.executable, "-c", BEGIN.format(niceness=niceness), *map(str, arguments)],
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=error_stream,
                    env={**os.environ, **ONE_THREAD, "PYTHONPATH": paths},
                    # Ctrl-C in the terminal must reach only the live view, which then ends this process.
                    start_new_session=True,
                )
        except OSError as error:
            raise ProcessError(
                f"A process for a fingervision command could not be started ({error.strerror}): close other programs."
            ) from error

    @property
    def exit_code(self) -> int | None:
        """Exit code of the command; None while it runs."""
        return self._process.poll()

    @property
    def output(self) -> str:
        """Text that the command has printed so far."""
        return self._out.read_text(encoding="utf-8")

    @property
    def complaint(self) -> str:
        """Last sentence that the command wrote to standard error, without the program's name."""
        lines = [line for line in self._error.read_text(encoding="utf-8").splitlines() if line.strip()]
        return lines[-1].removeprefix("fingervision: ").removeprefix("Error: ") if lines else ""

    def ended(self, stopped: Event | None = None) -> tuple[int | None, str]:
        """Wait for the end of the command; return its exit code and complaint, and no code if it was stopped before."""
        while (code := self.exit_code) is None and not (stopped or Event()).wait(LOOK_EVERY_S):
            pass
        return code, self.complaint

    def stop(self) -> None:
        """End the command if it is still running."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(ENDS_WITHIN_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._folder.cleanup()
