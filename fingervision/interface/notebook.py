"""Pictures for a notebook cell, embedded in the page so that the notebook can be sent to others."""

from base64 import b64encode
from collections.abc import Callable
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from fingervision.interface.argument_checks import path_of, speaks_python
from fingervision.storage.out_folder import own_folder

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


DOTS_PER_INCH = 80
"""Resolution of a figure in a notebook cell: 720 pixels for 9 inches, about the width of a notebook's column."""


def png_of(picture: NDArray[np.uint8]) -> bytes:
    """Encode an RGB picture, shape (height, width, 3), as PNG."""
    import cv2

    return bytes(cv2.imencode(".png", np.ascontiguousarray(picture[:, :, ::-1]))[1].tobytes())


def png_of_figure(figure: "Figure") -> bytes:
    """Encode a matplotlib figure as PNG."""
    content = BytesIO()
    figure.savefig(content, dpi=DOTS_PER_INCH, format="png")
    return content.getvalue()


def image_html(png: bytes) -> str:
    """Embed a PNG in HTML, no wider than its column."""
    return f'<img style="max-width:100%" alt="" src="data:image/png;base64,{b64encode(png).decode()}">'


# Base of results that are saved as the command of the same name saves them, and shown in a notebook cell.


class Drawn(Protocol):
    """Results that can be drawn."""

    def figure(self) -> "Figure":
        """Draw the residuals."""


@speaks_python
def save_results(measured: Path, folder: "str | os.PathLike[str]", write: Callable[[Path], object]) -> Path:
    """Write files into a folder, unless it holds the results of another table; return the folder.

    Raises
    ------
    UsageError
        The folder holds the results of another table.
    OutputError
        The file or folder cannot be written.
    """
    out = own_folder(path_of("folder", folder, "a folder"), measured, named=True)
    write(out)
    return out


def cell_html(results: Drawn, words: str) -> str:
    """Return the HTML of a notebook cell: a text and the figure of the residuals."""
    return f"<pre>{escape(words)}</pre>{image_html(png_of_figure(results.figure()))}"
