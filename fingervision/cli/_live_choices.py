"""Convert the options of the command `live` to settings of the live view."""

from pathlib import Path
from typing import TYPE_CHECKING

from fingervision.cli._where_to_measure import region_of

if TYPE_CHECKING:
    from fingervision.live.choices import Choices
    from fingervision.measuring.scale import Scale


def choices_of(
    source: str | None,
    calibration: Path | None,
    stated: tuple[float | None, float | None],
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> "Choices":
    """Read scale, measuring height, direction of the tips, and region of interest from the options.

    The argument `stated` contains the values of --px-per-mm and --u-px-per-mm.

    Raises
    ------
    DataError, InputFileError
        The calibration cannot be read.
    UsageError
        An option makes no sense.
    """
    from fingervision.domain.direction import Direction
    from fingervision.frames import simulated
    from fingervision.live.choices import Choices
    from fingervision.measuring.scale import check_one_scale, stated_scale
    from fingervision.storage.calibration_json import read_calibration

    px_per_mm, u_px_per_mm = stated
    check_one_scale(calibration, px_per_mm, u_px_per_mm)
    own = simulated.PX_PER_MM if source is not None and simulated.accepts(source) else None
    known = own if px_per_mm is None else px_per_mm
    scale: Scale | None = None
    if calibration is not None:
        scale = read_calibration(calibration)
    elif known is not None:
        scale = stated_scale(known, u_px_per_mm)
    return Choices(
        scale=scale,
        scale_file=calibration,
        below_tip_mm=below_tip_mm,
        direction=None if tips == "auto" else Direction(tips),
        region=region_of(roi),
    )
