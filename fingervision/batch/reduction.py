"""How the results of a command are brought into a table, a figure and small pictures: one module a command."""

import importlib
import pkgutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

import fingervision.batch
from fingervision.batch.digest import Digest
from fingervision.batch.task import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PREFIX = "results_of_"


class Reduction(Protocol):
    """What a module `results_of_<command>` offers."""

    COLUMNS: tuple[str, ...]
    """Columns of its table after those that every command has."""

    def digest_of(self, folder: Path) -> Digest:
        """Read one result folder."""
        ...

    def draw(self, figure: "Figure", outcomes: Sequence[Outcome]) -> None:
        """Draw all of them."""
        ...


def reduction_of(command: str) -> Reduction:
    """Find the reduction of a command.

    Raises
    ------
    ModuleNotFoundError
        The command's results have none.
    """
    return cast(Reduction, importlib.import_module(f"{fingervision.batch.__name__}.{PREFIX}{command}"))


def commands() -> tuple[str, ...]:
    """Name the commands whose results can be brought together."""
    names = (module.name for module in pkgutil.iter_modules(fingervision.batch.__path__))
    return tuple(sorted(name.removeprefix(PREFIX) for name in names if name.startswith(PREFIX)))
