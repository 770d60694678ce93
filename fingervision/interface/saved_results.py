"""Base of results that are saved as the command of the same name saves them, and shown in a notebook cell."""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from fingervision.interface.argument_checks import path_of
from fingervision.interface.argument_names import speaks_python
from fingervision.interface.notebook import image_html, png_of_figure
from fingervision.storage.out_folder import own_folder

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


class Results(Protocol):
    """Results from one measured table."""

    @property
    def measured(self) -> Path:
        """Path of the measured table, or a name for a table in memory."""

    def figure(self) -> "Figure":
        """Draw the residuals."""

    def write(self, out: Path) -> object:
        """Write the result's files into an existing folder."""


@speaks_python
def save_results(results: Results, folder: "str | os.PathLike[str]") -> Path:
    """Write the files into a folder, unless it holds the results of another table; return the folder.

    Raises
    ------
    UsageError
        The folder holds the results of another table.
    OutputError
        The file or folder cannot be written.
    """
    out = own_folder(path_of("folder", folder, "a folder"), results.measured, named=True)
    results.write(out)
    return out


def cell_html(results: Results, words: str) -> str:
    """Return the HTML of a notebook cell: a text and the figure of the residuals."""
    return f"<pre>{escape(words)}</pre>{image_html(png_of_figure(results.figure()))}"


__all__ = ["Results", "cell_html", "save_results"]
