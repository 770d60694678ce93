"""Requests about a recording: seek, step, play, mark a range, measure it."""

from typing import Any

from fingervision.domain.errors import StateError
from fingervision.live.commands.asking import Answer, Request, number, whole
from fingervision.live.playback.measured_range import RangeMeasurement
from fingervision.live.playback.playback import Playback
from fingervision.live.view import View

RANGE = "measured_range"


def _playback(view: View) -> Playback:
    if not isinstance(view, Playback):
        raise StateError("Seeking needs a recording, but this source is live: record it, and open the recording.")
    return view


def _seek(view: View, request: Request) -> Answer:
    _playback(view).seek(whole(request, "frame"))
    return Answer()


def _step(view: View, request: Request) -> Answer:
    playback = _playback(view)
    playback.seek(playback.frame + whole(request, "by"))
    return Answer()


def _play(view: View, request: Request) -> Answer:
    playback = _playback(view)
    speed = playback.speed if request.get("speed") is None else number(request, "speed")
    playback.play(on=bool(request.get("on")), speed=speed)
    return Answer()


def _range(view: View, request: Request) -> Answer:
    first, last = (None if request.get(name) is None else whole(request, name) for name in ("first", "last"))
    _playback(view).mark(first, last)
    return Answer()


def _measure(view: View, request: Request) -> Answer:
    playback = _playback(view)
    running = view.features.get(RANGE)
    if isinstance(running, RangeMeasurement) and running.is_running:
        raise StateError("A range is being measured already: wait until the measurement is done.")
    measurement = RangeMeasurement(playback, playback.range if request.get("marked") else None)
    view.features[RANGE] = measurement
    return Answer(f"Measuring into {measurement.folder}.")


def section(view: View) -> dict[str, Any]:
    """Return the state of the playback for the browser page."""
    if not isinstance(view, Playback):
        return {"playback": None}
    measuring = view.features.get(RANGE)
    return {
        "playback": {
            "frame": view.frame,
            "frames": view.frame_count,
            "playing": view.is_playing,
            "speed": view.speed,
            "range": None if view.range is None else list(view.range),
            "measured": view.row_count,
            "is_whole": view.table is not None,
            "failure": view.failure,
            "measuring": isinstance(measuring, RangeMeasurement) and measuring.is_running,
        }
    }


COMMANDS = {"seek": _seek, "step": _step, "play": _play, "range": _range, "measure": _measure}
