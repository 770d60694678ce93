"""Convert the options of the command `live` to settings of the live view."""

from pathlib import Path
from typing import TYPE_CHECKING

from fingervision.cli._where_to_measure import region_of
from fingervision.domain.errors import UsageError

if TYPE_CHECKING:
    from fingervision.live.choices import Choices


def choices_of(
    source: str | None,
    calibration: Path | None,
    px_per_mm: float | None,
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> "Choices":
    """Read scale, measuring height, direction of the tips, and region of interest from the options.

    Raises
    ------
    DataError, InputFileError
        The calibration cannot be read.
    UsageError
        An option makes no sense.
    """
    from calib.calibration import BareScale
    from fingervision.domain.direction import Direction
    from fingervision.frames import simulated
    from fingervision.live.choices import Choices
    from fingervision.measuring.scale import check_px_per_mm
    from fingervision.storage.calibration_json import read_calibration

    if calibration is not None and px_per_mm is not None:
        raise UsageError("Either --calibration or --px-per-mm gives the scale, but both are given: leave one out.")
    own = simulated.PX_PER_MM if source is not None and simulated.accepts(source) else None
    stated = own if px_per_mm is None else px_per_mm
    if stated is not None and not 0.0 < stated < float("inf"):
        raise UsageError(f"--px-per-mm must be positive, but is {stated:g}.")
    if stated is not None:
        check_px_per_mm(stated)
    scale = None if calibration is None else read_calibration(calibration)
    return Choices(
        scale=scale or (None if stated is None else BareScale(stated)),
        scale_file=calibration,
        below_tip_mm=below_tip_mm,
        direction=None if tips == "auto" else Direction(tips),
        region=region_of(roi),
    )
