"""Where a command's results go: never over those of another input."""

from pathlib import Path

import click


def results_folder(out: Path, source: Path) -> Path:
    """Give the folder that --out names, or the usual one; another where that holds the results of another input.

    Parameters
    ----------
    out : Path
        Value of --out.
    source : Path
        The input.

    Raises
    ------
    UsageError
        The folder that the user names holds the results of another input.
    """
    from fingervision.storage.result_owner import own_folder

    context = click.get_current_context()
    named = context.get_parameter_source("out") is not click.core.ParameterSource.DEFAULT
    found = own_folder(out, source, named=named)
    if found != out:
        click.echo(f"{out} holds the results of another input: these go to {found}.", err=True)
    return found


def running_command() -> str:
    """Give the command line that is running, as a result names it."""
    import shlex
    import sys

    return shlex.join(["fingervision", *sys.argv[1:]])
