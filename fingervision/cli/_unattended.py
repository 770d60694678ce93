"""Run a command from within a program: message and exit code are returned, and nothing is printed."""

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from threading import Lock

import click

from fingervision.batch.task import Ended
from fingervision.batch.work import NO_ROOM
from fingervision.cli import cli
from fingervision.domain.errors import ExitCode, FingervisionError

# The streams belong to the whole process; a Dask worker may have several threads.
_ONE_AT_A_TIME = Lock()


def perform(name: str, arguments: tuple[str, ...]) -> Ended:
    """Run a command in the same way as the command line does.

    Parameters
    ----------
    name : str
        The command's name.
    arguments : tuple of str
        Arguments and options as on the command line.
    """
    said = StringIO()
    with _ONE_AT_A_TIME, redirect_stdout(StringIO()), redirect_stderr(said):
        try:
            cli.main([name, *arguments], prog_name="fingervision", standalone_mode=False)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else ExitCode.DONE
            return Ended(int(code), said.getvalue().removeprefix("fingervision: ").strip(), finished=True)
        except click.ClickException as error:
            return Ended(error.exit_code, error.format_message(), finished=False)
        except click.Abort:
            return Ended(ExitCode.COULD_NOT, "The command was stopped before its end: call it again.", finished=False)
        except FingervisionError as error:
            return Ended(int(error.exit_code), str(error), finished=False, disk_full=_is_for_want_of_room(error))
        except Exception as error:  # a defect of this program in one recording must not stop the others
            words = f"A fault in fingervision ended the command ({type(error).__name__}: {error}): please report it."
            return Ended(ExitCode.COULD_NOT, words, finished=False, disk_full=_is_for_want_of_room(error))
    return Ended(ExitCode.DONE, "", finished=True)


def _is_for_want_of_room(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            return True
        error = error.__cause__ or error.__context__
    return False
