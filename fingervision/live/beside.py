"""Additional parts of a live measurement: a test bed, a log of the drive, a model, gauges."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from fingervision.domain.errors import DataError
from fingervision.frames.source import Driven
from fingervision.live.live_gauges import put_live_gauges
from fingervision.live.session import Session
from fingervision.live.view import View
from fingervision.motion.drive_at import drive_at

if TYPE_CHECKING:
    from fingervision.live.comparison.comparison import Comparison


@dataclass(frozen=True, slots=True)
class Beside:
    """What a live measurement does besides measuring the gap: options for model, gauges and bed.

    Parameters
    ----------
    model : Path or None
        File of the model that predicts the gap.
    kind : str
        Kind of model to build from a gripper.toml.
    drive : Path or None
        Log of the stage that drives the observed gripper; for a live source.
    drive_offset_s : float
        Offset added to the times of the log.
    allow_motion : bool
        Whether users of the browser page may move the test bed.
    gauges : Path or None
        File of user-defined gauges, which is read if it exists, and to which changes are saved.
    """

    model: Path | None = None
    kind: str = "lumped"
    drive: Path | None = None
    drive_offset_s: float = 0.0
    allow_motion: bool = False
    gauges: Path | None = None


def stand_beside(session: Session, beside: Beside) -> None:
    """Add the test bed, the drive log, the model and the gauges to a session.

    Raises
    ------
    DataError
        The log has fewer than two rows.
    FingervisionError
        The model or the log cannot be read, or the gauges are not for these frames.
    """
    if beside.gauges is not None:
        put_live_gauges(session, beside.gauges, is_asked_for=True)
    join = getattr(session.capture.source, "join", None)  # of a test bed
    if join is not None:
        expected = join(session, allow_motion=beside.allow_motion)
        beside = replace(beside, model=beside.model or expected)
    if beside.drive is not None:
        from fingervision.tables.read import read_drive

        drive = read_drive(beside.drive)
        if drive.time_s.size < 2:
            raise DataError(f"{beside.drive} must have at least two rows, but has {drive.time_s.size}.")

        def driven_at(time_s: float | None) -> Driven | None:
            found = None if time_s is None else drive_at(drive, time_s - beside.drive_offset_s)
            return None if found is None else Driven(found.input_mm, found.force_n, found.run or "1")

        session.driven_at = driven_at
    comparison = compared(session, beside)
    if comparison is not None:
        session.on_row.append(session.supervisor.guarded("Comparing with the model", comparison.add))


def compared(view: View, beside: Beside) -> "Comparison | None":
    """Add the comparison with a model to a view, if a model is given.

    Raises
    ------
    FingervisionError
        The model cannot be read.
    """
    if beside.model is None:
        return None
    from fingervision.live.comparison.comparison import Comparison  # a second that a view without a model does not wait

    comparison = Comparison(view, beside.model, beside.kind)
    view.features["model"] = comparison
    return comparison
