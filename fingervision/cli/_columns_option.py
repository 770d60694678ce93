"""The option that states the meaning of the columns of foreign tables."""

from pathlib import Path

import click

columns_option = click.option(
    "--columns",
    type=click.Path(path_type=Path),
    metavar="columns.toml",
    help="What the columns of foreign tables are (`fingervision table` writes it); else the columns.toml beside each.",
)
