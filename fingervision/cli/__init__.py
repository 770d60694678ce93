"""The command line: one command a file, found by its file's name; thin."""

import importlib
import pkgutil
import signal
import sys
from contextlib import suppress

import click

from fingervision import __version__
from fingervision.domain.errors import ExitCode, FingervisionError


class Commands(click.Group):
    """Every module in this package whose name has no leading underscore is a command of that name.

    The module holds it as `command` and imports nothing heavy at its top, so that `--help` stays fast.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, sorted."""
        return sorted(module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command's module, and only that."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command = importlib.import_module(f"{__name__}.{cmd_name}").command
        assert isinstance(command, click.Command)  # noqa: S101 - a file without a command is a fault of ours
        return command


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="fingervision")
def cli() -> None:
    """Measure a compliant gripper's finger gap in video, and explain where simulation and measurement disagree."""


def main() -> None:
    """Run the command line; a foreseen error is one sentence and an exit code, never a traceback."""
    # Who is asked to terminate (by a scheduler, at shut-down) ends as with Ctrl-C: in order, and with a sentence.
    with suppress(ValueError):  # not in a thread
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        cli(standalone_mode=True)
    except FingervisionError as error:
        click.echo(f"fingervision: {error}", err=True)
        sys.exit(error.exit_code)
    except SystemError as error:
        # Code that is being compiled hands Ctrl-C on as a failure of its own.
        if not _interrupted(error):
            raise
        click.echo("Aborted!", err=True)
        sys.exit(ExitCode.COULD_NOT)


def _interrupted(error: BaseException | None) -> bool:
    return error is not None and (
        isinstance(error, KeyboardInterrupt) or _interrupted(error.__cause__ or error.__context__)
    )
