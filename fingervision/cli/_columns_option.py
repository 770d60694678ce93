"""The option `--columns`, which states the meaning of the columns of tables written by other programs."""

from pathlib import Path

import click

columns_option = click.option(
    "--columns",
    type=click.Path(path_type=Path),
    metavar="columns.toml",
    help="Meaning of the columns, from `fingervision table`; default: the columns.toml beside each table.",
)
