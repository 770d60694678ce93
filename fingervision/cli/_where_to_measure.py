"""Options of every command that measures pictures: the scale, the height, the tips' direction, the region."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fingervision.domain.errors import UsageError

if TYPE_CHECKING:
    from fingervision.domain.region import Region

OPTIONS = (
    click.option(
        "--calibration", type=click.Path(path_type=Path), help="calibration.json: the scale with its uncertainty."
    ),
    click.option("--px-per-mm", type=float, help="The scale alone; the uncertainty then holds the random part alone."),
    click.option(
        "--below-tip-mm",
        type=float,
        default=0.3,
        show_default=True,
        help="How far below each finger's tip the gap is measured.",
    ),
    click.option(
        "--tips",
        type=click.Choice(["auto", "up", "down", "left", "right"]),
        default="auto",
        show_default=True,
        help="Where the fingers point in the picture.",
    ),
    click.option(
        "--roi", metavar="X,Y,W,H", help="Region of interest: first column, first row, width, height in pixels."
    ),
)


def where_to_measure(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command these options."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def region_of(words: str | None) -> "Region | None":
    """Read --roi.

    Raises
    ------
    UsageError
        It is not four whole numbers.
    """
    from fingervision.domain.region import Region

    if words is None:
        return None
    try:
        x_px, y_px, width_px, height_px = (int(part) for part in words.split(","))
    except ValueError:
        raise UsageError(f"--roi must be four whole numbers X,Y,W,H in pixels, but is '{words}'.") from None
    return Region(x_px, y_px, width_px, height_px)
