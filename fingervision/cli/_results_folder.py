"""Folder for a command's results; the results of another input are never overwritten."""

from pathlib import Path

import click


def results_folder(out: Path, source: Path) -> Path:
    """Return the folder of --out or the default folder; if it has results of another input, choose a new name.

    Parameters
    ----------
    out : Path
        Value of --out.
    source : Path
        The input file or folder of the command.

    Raises
    ------
    UsageError
        The folder that the user names holds the results of another input.
    """
    from fingervision.storage.out_folder import own_folder

    context = click.get_current_context()
    named = context.get_parameter_source("out") is not click.core.ParameterSource.DEFAULT
    found = own_folder(out, source, named=named)
    if found != out:
        click.echo(f"{out} holds the results of another input: the new results are written to {found}.", err=True)
    return found


def running_command() -> str:
    """Return the command line of this process, for the provenance of a result."""
    import shlex
    import sys

    return shlex.join(["fingervision", *sys.argv[1:]])
