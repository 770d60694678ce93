"""Plots as files for a paper: SVG and PDF, identical for identical data; PNG for an HTML page."""

import io
from contextlib import AbstractContextManager
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

FORMATS = ("svg", "pdf")
PNG_DPI = 110
"""Resolution of the pictures beside the vector figures: about one pixel of a desktop screen per pixel."""


def plain_style() -> AbstractContextManager[None]:
    """Apply the common style of a report's plots; text is stored as text, so that it can be searched and edited."""
    style: dict[str, object] = {
        "font.size": 9,
        "axes.titlesize": 10,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "svg.fonttype": "none",
        "svg.hashsalt": "fingervision",
        "pdf.fonttype": 42,
    }
    return mpl.rc_context(style)  # type: ignore[arg-type]


def write_vector(figure: Figure, stem: Path) -> tuple[Path, ...]:
    """Write a plot as SVG and as PDF; `stem` is the path without its suffix."""
    written = []
    for kind in FORMATS:
        path = stem.with_name(f"{stem.name}.{kind}")
        metadata = {"Date": None} if kind == "svg" else {"CreationDate": None, "Producer": None}
        with plain_style():
            figure.savefig(path, format=kind, metadata=metadata)
        # One layout serves every format; it takes longer than drawing.
        figure.set_layout_engine(None)
        written.append(path)
    return tuple(written)


def png_bytes(figure: Figure) -> bytes:
    """Encode a plot as PNG."""
    buffer = io.BytesIO()
    with plain_style():
        figure.savefig(buffer, format="png", dpi=PNG_DPI)
    return buffer.getvalue()
