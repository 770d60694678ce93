"""Options shared by all commands that measure pictures: scale, measuring height, tip direction, region of interest."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fingervision.cli._number import NUMBER

if TYPE_CHECKING:
    from fingervision.domain.region import Region


def _take_settings(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Take the values of options that the user does not give from a settings file."""
    if path is None:
        return None
    from fingervision.storage.settings_toml import read_settings

    found = read_settings(path)
    camera = found.pop("camera", {})
    if any(each.name == "exposure_ms" for each in context.command.params):
        found |= camera
    known = {each.name for each in context.command.params}
    context.default_map = {name: value for name, value in found.items() if name in known}
    return path


OPTIONS = (
    click.option(
        "--settings",
        type=click.Path(path_type=Path),
        is_eager=True,
        expose_value=False,
        callback=_take_settings,
        help="Settings file, as saved by the browser page; options on the command line override it.",
    ),
    click.option(
        "--calibration",
        type=click.Path(path_type=Path),
        help="File calibration.json with the scale and its uncertainty.",
    ),
    click.option(
        "--px-per-mm",
        type=NUMBER,
        help="Scale in pixels per mm; without --u-px-per-mm, only the random part of the uncertainty is given.",
    ),
    click.option(
        "--u-px-per-mm",
        type=NUMBER,
        help="Standard uncertainty of --px-per-mm, in pixels per mm; u_gap_mm then includes it.",
    ),
    click.option(
        "--below-tip-mm",
        type=NUMBER,
        default=0.3,
        show_default=True,
        help="Distance (mm) below each finger's tip at which the gap is measured.",
    ),
    click.option(
        "--tips",
        type=click.Choice(["auto", "up", "down", "left", "right"]),
        default="auto",
        show_default=True,
        help="Direction in which the fingertips point in the picture.",
    ),
    click.option(
        "--roi", metavar="X,Y,W,H", help="Region of interest: first column, first row, width, height in pixels."
    ),
)
PICTURE_OPTIONS = (
    click.option(
        "--response",
        default="auto",
        show_default=True,
        metavar="auto|linear|srgb|bt709|FILE",
        help="Camera response; auto: that of the calibration, else that which the shape of the edges shows, else the "
        "recording's own tag, else linear.",
    ),
    click.option(
        "--bits",
        type=click.IntRange(8, 16),
        help="True bit depth of grey levels that are stored in 16 bits, if it is less than 16.",
    ),
    click.option(
        "--fingers",
        type=click.Choice(["auto", "dark", "light"]),
        default="auto",
        show_default=True,
        help="Whether the fingers are darker or lighter than the background.",
    ),
)


def where_to_measure(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of scale, height, direction and region to a command."""

    @wraps(command)
    def with_one_scale(**options: Any) -> Any:
        context = click.get_current_context()
        from_file = click.core.ParameterSource.DEFAULT_MAP
        for given, other in (("px_per_mm", "calibration"), ("calibration", "px_per_mm")):
            sources = [context.get_parameter_source(name) for name in (given, other)]
            if options[given] is not None and sources[0] is not from_file and sources[1] is from_file:
                # A scale on the command line replaces the scale of the file, also one of the other kind.
                options[other] = None
        is_of_file = context.get_parameter_source("u_px_per_mm") is from_file
        if is_of_file and (options["px_per_mm"] is None or context.get_parameter_source("px_per_mm") is not from_file):
            options["u_px_per_mm"] = None  # it belongs to the file's scale
        return command(**options)

    decorated: Callable[..., Any] = with_one_scale
    for option in reversed(OPTIONS):
        decorated = option(decorated)
    return decorated


def how_to_read_pictures(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of response, bit depth and polarity to a command."""
    for option in reversed(PICTURE_OPTIONS):
        command = option(command)
    return command


def region_of(words: str | None) -> "Region | None":
    """Read the region of interest from the words of the option --roi.

    Raises
    ------
    UsageError
        The region is not four whole numbers.
    """
    from fingervision.cli._references import region_from
    from fingervision.domain.region import Region

    box = region_from(words)
    return None if box is None else Region(*box)
