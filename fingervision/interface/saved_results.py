"""Results that save themselves as the command of their name does, and show themselves in a notebook's cell."""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from fingervision.interface.argument_checks import path_of
from fingervision.interface.argument_names import speaks_python
from fingervision.interface.notebook import image_html, png_of_figure
from fingervision.storage.result_owner import own_folder

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


class Results(Protocol):
    """What was found beside one measured table."""

    @property
    def measured(self) -> Path:
        """The table's file, or a name for what was in memory."""

    def figure(self) -> "Figure":
        """Draw the residuals."""

    def write(self, out: Path) -> object:
        """Write the files into a folder that may be used."""


@speaks_python
def save_results(results: Results, folder: "str | os.PathLike[str]") -> Path:
    """Write the files into a folder, unless it holds the results of another table; give the folder.

    Raises
    ------
    UsageError
        The folder holds the results of another table.
    OutputError
        It cannot be written.
    """
    out = own_folder(path_of("folder", folder, "a folder"), results.measured, named=True)
    results.write(out)
    return out


def cell_html(results: Results, words: str) -> str:
    """Show words and the figure of the residuals in a notebook's cell."""
    return f"<pre>{escape(words)}</pre>{image_html(png_of_figure(results.figure()))}"


__all__ = ["Results", "cell_html", "save_results"]
