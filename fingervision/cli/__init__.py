"""The command line: each command is defined in its own module and found by the module's name."""

import errno
import importlib
import os
import pkgutil
import signal
import sys
import unicodedata
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

import click

from fingervision import __version__
from fingervision.cli._command import COLOUR, Group, complain
from fingervision.domain.errors import ExitCode, FingervisionError, UsageError

TRACEBACK = "FINGERVISION_TRACEBACK"
"""Environment variable with which an unexpected error prints its traceback."""
COMMONEST = ("measure", "inspect", "calibrate", "compare", "diagnose", "model", "live", "batch")
"""Commands that stand first in the list, in the order in which a newcomer meets them."""
OUTPUT_ERRORS = (errno.ENOSPC, errno.EIO, errno.EPIPE)


class Commands(Group):
    """Command group in which every module of this package without a leading underscore is a command.

    The module's name is that of the command, and its variable `command` is the command itself. The module imports no
    large libraries at module level, so that `--help` is fast.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse empty names, because an empty path would mean the current folder."""
        for number, argument in enumerate(args, start=1):
            if argument == "" or (argument.startswith("--") and argument.endswith("=")):
                raise UsageError(
                    f"A file name, folder name or value must not be empty, but argument {number}"
                    f"{', ' + argument + ',' if argument else ''} is empty: give one, or leave the option out."
                )
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands: the commonest, then the others, sorted."""
        found = {module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_")}
        return [*(name for name in COMMONEST if name in found), *sorted(found - set(COMMONEST))]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import only the module of the requested command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command = importlib.import_module(f"{__name__}.{cmd_name}").command
        assert isinstance(command, click.Command)  # noqa: S101 - a module without a command is a defect of this package
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; an error about an argument states the name of the command-line option."""
        from fingervision.interface.argument_checks import command_words

        try:
            with command_words():
                return super().invoke(ctx)
        except KeyboardInterrupt:
            complain("Stopped before it was done, as asked (Ctrl-C or SIGTERM).")
            ctx.exit(ExitCode.COULD_NOT)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "color": COLOUR})
@click.version_option(__version__, prog_name="fingervision")
def cli() -> None:
    """Measure a compliant gripper's finger gap in video, and explain where simulation and measurement disagree."""


def main() -> None:
    """Run the command line; an expected error gives one sentence and an exit code, never a traceback."""
    # SIGTERM (from a scheduler or at shut-down) has the effect of Ctrl-C: the command ends in order, with a message.
    with suppress(ValueError):  # not in a thread
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    _mend_streams()
    try:
        Path.cwd()
    except FileNotFoundError:
        complain("The current folder does not exist any more: change to a folder that exists.")
        sys.exit(ExitCode.COULD_NOT)
    try:
        cli(standalone_mode=True)
    except FingervisionError as error:
        complain(_printable(str(error)))
        sys.exit(error.exit_code)
    except Exception as error:
        # Errors of files are reported where the files are written; an error without a file name concerns standard
        # output.
        if isinstance(error, OSError) and error.filename is None and error.errno in OUTPUT_ERRORS:
            _give_up_output(error)
        if TRACEBACK in os.environ:
            raise
        complain(_printable(_of_system(error) or _unexpected(error)))
        sys.exit(ExitCode.COULD_NOT)
    finally:
        try:
            sys.stdout.flush()
        except OSError as error:
            _give_up_output(error)


def _of_system(error: Exception) -> str | None:
    """Sentence on an error of the operating system, for which neither the input nor this program is to blame."""
    if isinstance(error, MemoryError):
        return "This needs more memory than the machine has free: close other programs, or choose a smaller input."
    # Python 3.13 passes on the system's error, where older ones raise their own.
    is_loop = isinstance(error, RuntimeError) and "Symlink loop" in str(error)
    if is_loop or (isinstance(error, OSError) and error.errno == errno.ELOOP):
        return f"A symbolic link leads back to itself ({error}): name a real file or folder."
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return "A file name must fit the limits of the operating system, but is too long: shorten it."
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename} cannot be used ({error.strerror}): check its name, its permissions and the disk."
    return None


def _unexpected(error: Exception) -> str:
    """Sentence on an error that no part of the program expects; its traceback goes to a file."""
    import platform
    import tempfile
    import traceback

    words = [f"fingervision {__version__}, Python {platform.python_version()}, {platform.platform()}"]
    words += [repr(sys.argv), "".join(traceback.format_exception(error))]
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="fingervision-", suffix=".txt", delete=False, encoding="utf-8", errors="backslashreplace"
        ) as file:
            file.write("\n\n".join(words))
        kept = f"the details are in {file.name}"
    except OSError:
        kept = f"{TRACEBACK}=1 before the command prints the details"
    return (
        f"The command ended with an error that it does not know ({type(error).__name__}: {str(error)[:200]}): an input "
        "has content that is not foreseen, or the program has a defect. The input is unchanged. Please report this "
        f"with the input; {kept}."
    )


def _printable(words: str) -> str:
    """Escape control characters except line ends, because a file name may contain some that a terminal executes."""
    return "".join(
        each if each == "\n" or unicodedata.category(each) != "Cc" else each.encode("unicode_escape").decode()
        for each in words
    )


def _mend_streams() -> None:
    """Replace closed standard streams, and allow printing of file names that are not valid UTF-8."""
    # The next file that is opened would get the number of the closed stream, and FFmpeg would print its messages into
    # it.
    while (lowest := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(lowest)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115, PTH123 - open to the end
        elif hasattr(stream, "reconfigure") and name != "stdin":
            stream.reconfigure(errors="surrogateescape")


def _give_up_output(error: OSError) -> NoReturn:
    # Otherwise Python would flush the stream again at exit, and print a message of its own.
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if error.errno != errno.EPIPE:
        complain(f"Standard output could not be written completely ({error.strerror}): free disk space.")
    sys.exit(ExitCode.COULD_NOT)
