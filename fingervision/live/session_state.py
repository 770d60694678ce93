"""State of a live measurement and of its settings, as sent to the browser page."""

from typing import TYPE_CHECKING, Any

from calib.measured_scale import Calibration
from fingervision.domain.status import Status
from fingervision.live.choices import Choices

if TYPE_CHECKING:
    from fingervision.live.session import Session


def state_of_choices(choices: Choices) -> dict[str, Any]:
    """Return scale, region, height, zero and tolerance, for the browser page."""
    scale, region = choices.scale, choices.region
    return {
        "zero_mm": choices.zero_mm,
        "px_per_mm": None if scale is None else scale.px_per_mm,
        "u_px_per_mm": scale.u_px_per_mm if isinstance(scale, Calibration) else None,
        "region": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
        "tips": "auto" if choices.direction is None else choices.direction.value,
        "fingers": {None: "auto", True: "dark", False: "light"}[choices.fingers_are_dark],
        "below_tip_mm": choices.below_tip_mm,
        "least_mm": choices.least_mm,
        "greatest_mm": choices.greatest_mm,
    }


def state_of_session(session: "Session") -> dict[str, Any]:
    """Return source, frame rate, losses and recording, for the browser page."""
    cadence, recorder, description = session.cadence, session.recording, session.description
    jitter_s = cadence.jitter_s
    return {
        "source": description.name,
        "kind": description.kind,
        "whole": False,
        "width_px": description.width_px,
        "height_px": description.height_px,
        "rate_hz": cadence.rate_hz,
        "camera": ", ".join(f"{name} {value}" for name, value in session.capture.source.description.camera.items()),
        "jitter_ms": None if jitter_s is None else 1e3 * jitter_s,
        "dropped": cadence.missing + session.capture.overflowed,
        "duplicates": session.counts[Status.DUPLICATE],
        "damaged": session.counts[Status.DAMAGED],
        "exposure": session.exposure.words,
        "silent_s": session.silent_s,
        "ended": session.ended.is_set(),
        "trouble": session.supervisor.trouble,
        "recording": None
        if recorder is None
        else {
            "path": str(recorder.run.path),
            "frames": recorder.run.frames,
            "minutes_left": recorder.minutes_left,
        },
        **state_of_choices(session.choices),
    }
