"""`fingervision calibrate response`: camera response from an exposure series, a grey wedge or straight edges."""

import json
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from calib.camera_response import MeasuredResponse
from calib.measured_response import response_from_exposures, response_from_wedge
from calib.response_from_edges import response_from_edges
from fingervision.cli._options import named_references, region_from
from fingervision.domain.errors import UsageError
from fingervision.interface.reference_pictures import read_pictures
from fingervision.storage.response_csv import write_response
from fingervision.vision.grey import top_level

MOST_FIELDS = 200


def measure_response(
    items: Sequence[str], edges: bool, densities: str | None, roi: str | None, out: Path, as_json: bool
) -> None:
    """Measure the camera's response, write the response to a file, and print its description.

    Raises
    ------
    UsageError
        The options request two methods at once, or an item has the wrong form.
    CalibrationError
        The pictures do not determine a response.
    """
    if edges and densities is not None:
        raise UsageError(
            "--edges and --densities are two ways to measure the camera's response, but both were given: choose one."
        )
    if roi is not None and densities is None:
        raise UsageError("--roi is for the fields of a grey wedge, but their densities are not given: add --densities.")
    if edges or densities is not None:
        exposed = [item for item in items if "=" in item and not Path(item).exists()]
        if exposed:
            raise UsageError(
                f"With --edges or --densities, a picture must be named without an exposure time, but {exposed[0]} has "
                f"one."
            )
        pictures = [grey for _, grey in read_pictures([Path(item) for item in items])]
        top = max(top_level(grey) for grey in pictures)
        if densities is None:
            found = response_from_edges(pictures, top, out.name)
        else:
            if len(pictures) != 1:
                raise UsageError(f"A grey wedge is measured in one picture, but {len(pictures)} were given: name one.")
            found = response_from_wedge(pictures[0], _densities(densities), top, out.name, region_from(roi))
    else:
        named = named_references(items, "bar", "EXPOSURE with a positive exposure", "e20.png=2")
        pictures = [grey for _, grey in read_pictures([path for path, *_ in named])]
        top = max(top_level(grey) for grey in pictures)
        found = response_from_exposures(pictures, [value for _, value, _ in named], top, out.name)
    write_response(found.response, out)
    _say(found, top, out, as_json)


def _densities(words: str) -> list[float]:
    """Read optical densities in the form A:B:STEP or A,B,..."""
    refusal = UsageError(f"--densities must be A:B:STEP, such as 0.05:1.95:0.1, or a list A,B,..., but is {words}.")
    try:
        numbers = [float(part) for part in words.replace(":", ",").split(",")]
    except ValueError:
        raise refusal from None
    if ":" not in words:
        return numbers
    first, last, step = numbers if len(numbers) == 3 else (0.0, 0.0, 0.0)
    if not (np.isfinite(numbers).all() and step > 0.0 and step <= last - first <= MOST_FIELDS * step):
        raise refusal
    count = round((last - first) / step) + 1
    if abs(first + (count - 1) * step - last) > 0.01 * step:
        raise refusal
    return [first + k * step for k in range(count)]


def _say(found: MeasuredResponse, top: int, out: Path, as_json: bool) -> None:
    if as_json:
        content = {
            "out": str(out),
            "exponent": found.exponent,
            "u_exponent": found.u_exponent,
            "rms_relative": found.rms_relative,
            "least_level": found.covered[0] * top,
            "largest_level": found.covered[1] * top,
        }
        click.echo(json.dumps(content))
        return
    known = "" if found.u_exponent is None else f" +-{2.0 * found.u_exponent:.3f} (95 %)"
    click.echo(
        f"The camera's response is nearest to a power law with an exponent of {found.exponent:.3f}{known} (1 is "
        f"linear). The measured response reproduces the light to {100.0 * found.rms_relative:.2f} % (RMS), for grey "
        f"levels from {found.covered[0] * top:.0f} to {found.covered[1] * top:.0f} of {top}."
    )
    click.echo(f"Written: {out}")
