"""Additional parts of a live measurement: a test bed, a log of the drive, a model, gauges."""

from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.frames.source import Driven
from fingervision.live.bed.bench import Bench
from fingervision.live.comparison.comparison import Comparison
from fingervision.live.live_gauges import put_live_gauges
from fingervision.live.session import Session
from fingervision.motion.drive_at import drive_at
from fingervision.storage.out_folder import make_out_folder
from fingervision.tables.read import read_drive
from fingervision.testbed.run.run_folder import SIMULATION, write_expected


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
    model, bench = beside.model, session.capture.source
    if beside.gauges is not None:
        put_live_gauges(session, beside.gauges, is_asked_for=True)
    if isinstance(bench, Bench):
        session.features |= {"bed": bench, "allow_motion": beside.allow_motion}
        bench.say, bench.supervisor = session.say, session.supervisor
        if model is None and bench.bed.model is not None:
            # Prediction for the bed's gripper without the hidden effects, in the same form as the file beside a run's
            # table.
            make_out_folder(session.out)
            model = session.out / SIMULATION
            write_expected(model, bench.bed.model, bench.bed.limits)
    if beside.drive is not None:
        drive = read_drive(beside.drive)
        if drive.time_s.size < 2:
            raise DataError(f"{beside.drive} must have at least two rows, but has {drive.time_s.size}.")

        def driven_at(time_s: float | None) -> Driven | None:
            found = None if time_s is None else drive_at(drive, time_s - beside.drive_offset_s)
            return None if found is None else Driven(found.input_mm, found.force_n, found.run or "1")

        session.driven_at = driven_at
    if model is not None:
        comparison = Comparison(session, model, beside.kind)
        session.features["model"] = comparison
        session.on_row.append(session.supervisor.guarded("Comparing with the model", comparison.add))
