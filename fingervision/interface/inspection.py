"""`fingervision.inspect`: what limits the measurement with this set-up, worst first, and what to change."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.calibration import BareScale
from fingervision.domain.errors import ArgumentError
from fingervision.frames.source import FrameSource, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.inspection.catalogue import inspect as findings_of
from fingervision.inspection.catalogue import to_mend
from fingervision.inspection.finding import Finding
from fingervision.inspection.frames_to_look_at import frames_to_look_at
from fingervision.inspection.report import as_json, as_text
from fingervision.inspection.sample import Sample, take_sample
from fingervision.interface.argument_checks import number, one_of, path_of, region_of, speaks_python
from fingervision.interface.frame_sources import recording_of
from fingervision.interface.measuring_task import measuring_task, scale_of
from fingervision.measuring.task import task_for_frames

if TYPE_CHECKING:
    import os

    import numpy as np
    from numpy.typing import NDArray

    from calib.camera_response import CameraResponse
    from fingervision.interface.calibration import Calibration

WITHOUT_SCALE_PX = 10.0
"""Distance (pixels) below the tips at which the edges are measured if there is no scale."""


@dataclass(frozen=True, eq=False, repr=False)
class Inspection:
    """Result of `fingervision.inspect`; iterating over it gives the findings, the most severe first.

    Parameters
    ----------
    findings : tuple of Finding
        Every limit that was examined, with its cost and the remedy.
    notes : tuple of str
        Remarks on the recording.
    sample : Sample
        The inspected frames.
    """

    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    sample: Sample = field(repr=False)

    def __len__(self) -> int:
        return len(self.findings)

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __getitem__(self, name: str) -> Finding:
        """Return the finding of a name, such as focus or light."""
        return next(finding for finding in self.findings if finding.name == name)

    @property
    def to_mend(self) -> tuple[Finding, ...]:
        """Findings that cost more than the uncertainty of a good set-up, the most severe first."""
        return tuple(to_mend(list(self.findings)))

    def report(self) -> str:
        """Return the result as the command prints it."""
        return "\n".join([as_text(self.sample, list(self.findings)), *self.notes])

    def as_json(self) -> dict[str, Any]:
        """Return the result as data that JSON can represent, as the command prints it with `--json`."""
        return as_json(self.sample, list(self.findings))

    @speaks_python
    def save_picture(self, path: "str | os.PathLike[str]") -> Path:
        """Draw the inspected frame with its findings into a file, as the command does.

        Raises
        ------
        OutputError
            The file or folder cannot be written.
        """
        from fingervision.inspection.picture import draw_inspection

        out = path_of("path", path, "a picture's file")
        draw_inspection(out, self.sample, list(self.findings))
        return out

    def __repr__(self) -> str:
        worst = ", ".join(finding.name for finding in self.to_mend) or "nothing to mend"
        return f"Inspection({self.sample.description.name}, {self.sample.frames} frames: {worst})"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.report())}</pre>"


@speaks_python
def inspect(
    source: "NDArray[np.generic] | str | os.PathLike[str] | int | FrameSource",
    *,
    calibration: "str | os.PathLike[str] | Calibration | None" = None,
    px_per_mm: float | None = None,
    u_px_per_mm: float | None = None,
    below_tip_mm: float = 0.3,
    tips: str = "auto",
    roi: Sequence[int] | None = None,
    seconds: float = 5.0,
    rate_hz: float | None = None,
    response: "str | os.PathLike[str] | CameraResponse" = "auto",
    bits: int | None = None,
    fingers: str = "auto",
) -> Inspection:
    """Watch a recording or a camera for some seconds, and list what limits the measurement, worst first.

    Parameters
    ----------
    source, calibration, px_per_mm, u_px_per_mm, below_tip_mm, tips, roi, rate_hz, response, bits, fingers
        The same as the arguments of `fingervision.measure`; without a scale, costs are in pixels only.
    seconds : float
        Duration of the inspected part.

    Returns
    -------
    Inspection
        The findings, each with its numbers, its cost and the remedy.

    Raises
    ------
    UsageError
        An argument has an impossible value.
    DataError, DeviceError, InputFileError
        The recording or the calibration cannot be read.

    Examples
    --------
    >>> import fingervision as fv
    >>> found = fv.inspect("sample_frames/opening/opening.mp4", px_per_mm=34.0, seconds=0.5)
    >>> found["focus"].severity.value
    'good'
    """
    from fingervision.frames import simulated

    if not 0.0 < (seconds := number("seconds", seconds)) < float("inf"):
        raise ArgumentError("seconds", "be positive", f"is {seconds:g}")
    is_live = isinstance(source, int) or (isinstance(source, str) and not Path(source).exists())
    opened = open_source(str(source), Wish(rate_hz=rate_hz)) if is_live else recording_of(source, rate_hz=rate_hz)()
    try:
        if calibration is None and px_per_mm is None and isinstance(source, str) and simulated.accepts(source):
            px_per_mm = simulated.PX_PER_MM
        has_scale = calibration is not None or px_per_mm is not None or u_px_per_mm is not None
        unscaled = BareScale(WITHOUT_SCALE_PX / below_tip_mm if below_tip_mm > 0.0 else 1.0)
        task = measuring_task(
            scale=scale_of(calibration, px_per_mm, u_px_per_mm) if has_scale else (unscaled, None),
            below_tip_mm=below_tip_mm,
            tips=tips,
            roi=region_of(roi),
            response=response,
            bits=bits,
            fingers=one_of("fingers", fingers, ("auto", "dark", "light")),
        )
        description = opened.description
        task = task_for_frames(task, description)
        settings, warning = task.settings_for(description.files)
        sample = take_sample(
            frames_to_look_at(opened, seconds), description, settings, task.scale if has_scale else None
        )
    finally:
        if hasattr(opened, "close"):
            opened.close()
    notes = tuple(words for words in (*description.notes, warning) if words)
    return Inspection(tuple(findings_of(sample)), notes, sample)
