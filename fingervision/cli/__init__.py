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
from fingervision.domain.errors import ExitCode, FingervisionError, UsageError


class Commands(click.Group):
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
        """Names of the subcommands, sorted."""
        return sorted(module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import only the module of the requested command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command = importlib.import_module(f"{__name__}.{cmd_name}").command
        assert isinstance(command, click.Command)  # noqa: S101 - a module without a command is a defect of this package
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; an error about an argument states the name of the command-line option."""
        from fingervision.interface.argument_names import command_words

        with command_words():
            return super().invoke(ctx)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
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
        click.echo(
            "fingervision: The current folder does not exist any more: change to a folder that exists.", err=True
        )
        sys.exit(ExitCode.COULD_NOT)
    try:
        cli(standalone_mode=True)
    except FingervisionError as error:
        click.echo(f"fingervision: {_printable(str(error))}", err=True)
        sys.exit(error.exit_code)
    except RuntimeError as error:
        if "Symlink loop" not in str(error):
            raise
        click.echo(
            f"fingervision: A symbolic link leads back to itself ({error}): name a real file or folder.", err=True
        )
        sys.exit(ExitCode.COULD_NOT)
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            click.echo(
                "fingervision: A file name must fit the limits of the operating system, but is too long: shorten it.",
                err=True,
            )
            sys.exit(ExitCode.COULD_NOT)
        # Errors of files are reported where the files are written; an error without a file name concerns standard
        # output.
        if error.filename is not None or error.errno not in (errno.ENOSPC, errno.EIO, errno.EPIPE):
            raise
        _give_up_output(error)
    finally:
        try:
            sys.stdout.flush()
        except OSError as error:
            _give_up_output(error)


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
        click.echo(
            f"fingervision: Standard output could not be written completely ({error.strerror}): free disk space.",
            err=True,
        )
    sys.exit(ExitCode.COULD_NOT)
