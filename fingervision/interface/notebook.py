"""Pictures for a notebook cell, embedded in the page so that the notebook can be sent to others."""

from base64 import b64encode
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
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


__all__ = ["image_html", "png_of", "png_of_figure"]
