"""Summaries of the results of a command in a table, a plot and small plots, with one module per command."""

import importlib
import pkgutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

import fingervision.batch
from fingervision.batch.task import Digest, Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PREFIX = "results_of_"


class Reduction(Protocol):
    """Protocol of a module `results_of_<command>`."""

    COLUMNS: tuple[str, ...]
    """Columns of the command's table, after the columns that every command has."""

    def digest_of(self, folder: Path) -> Digest:
        """Summarise one result folder."""
        ...

    def draw(self, figure: "Figure", outcomes: Sequence[Outcome]) -> None:
        """Draw the plot of all results."""
        ...


def reduction_of(command: str) -> Reduction:
    """Find the module that summarises the results of a command.

    Raises
    ------
    ModuleNotFoundError
        There is no module for this command.
    """
    return cast(Reduction, importlib.import_module(f"{fingervision.batch.__name__}.{PREFIX}{command}"))


def commands() -> tuple[str, ...]:
    """Names of the commands whose results a batch can summarise."""
    names = (module.name for module in pkgutil.iter_modules(fingervision.batch.__path__))
    return tuple(sorted(name.removeprefix(PREFIX) for name in names if name.startswith(PREFIX)))
