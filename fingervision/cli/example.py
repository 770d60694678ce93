"""`fingervision example`: copy a runnable example into a new folder."""

from pathlib import Path

import click

from fingervision.cli._command import make_command
from fingervision.cli._options import out_option

EXAMPLES = """
\b
Examples:
  fingervision example
  fingervision example measure
  fingervision example diagnose --out trial

\b
The examples of `fingervision NAME --help` work in the folder that `fingervision example NAME` writes.
"""


@make_command(EXAMPLES)
@click.argument("name", required=False)
@out_option(words="The new folder; example-NAME if not given.")
def command(name: str | None, out: Path | None) -> None:
    """Copy the runnable example NAME into a new folder, or list all examples."""
    from fingervision.domain.errors import UsageError
    from fingervision.interface.examples import CASES, copy_example

    if name is None:
        if out is not None:
            raise UsageError("--out needs the name of an example, but none is given: add the name.")
        for each, case in CASES.items():
            click.echo(f"{each:10} {case.words}")
        return
    folder = out or Path(f"example-{name}")
    case = copy_example(name, folder)
    click.echo(f"{len(list(folder.rglob('*.*')))} files copied to {folder}. Next:\n  cd {folder}\n  {case.run}")
