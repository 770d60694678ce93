"""Requests about a recording: seek, step, play, mark a range, measure it."""

import json
from pathlib import Path
from typing import Any

from fingervision.domain.errors import StateError
from fingervision.live.background import WAITED_FOR, BackgroundCommand
from fingervision.live.commands.asking import Answer, Request, number, whole
from fingervision.live.playback.gauge_following import GAUGES, GaugesBeside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.track import WHOLE, arguments_of
from fingervision.live.view import View
from fingervision.measuring.task import NO_FINGERS
from fingervision.measuring.words import gauge_sentence

# Measurement of a range of a recording by the command `measure`, whose results are saved.


MEASURING = "Measuring a range"


class RangeMeasurement:
    """One execution of `fingervision measure` in a separate process.

    Parameters
    ----------
    playback : Playback
        The recording with its measurement settings.
    frames : (int, int) or None
        First and last frame; None for all frames.

    Raises
    ------
    FingervisionError
        The scale is not known.
    """

    def __init__(self, playback: Playback, frames: tuple[int, int] | None) -> None:
        if playback.choices.scale is None:
            raise StateError("The scale is not known: give the scale before measuring.")
        beside = playback.features.get(GAUGES)
        gauges: tuple[str, ...] = ()
        if isinstance(beside, GaugesBeside) and beside.board.gauges:
            if not beside.board.is_saved:
                raise StateError("The gauges have changes that are not saved: save them before measuring.")
            gauges = ("--gauges", str(beside.board.path))
        path = Path(playback.recorded.name)
        name = path.parent.resolve().name if path.name == "video.mp4" else path.stem
        part = "" if frames is None else f"_{frames[0]}_{frames[1]}"
        self.folder = playback.out / f"measured_{_plain(name)}{part}"
        more = () if frames is None else ("--frames", f"{frames[0]}:{frames[1]}")
        arguments = arguments_of(playback.recorded.name, playback.choices, playback.recorded.options)
        self._playback = playback
        self._command = BackgroundCommand(
            *arguments, *more, *gauges, "--out", str(self.folder), "--json", niceness=WAITED_FOR
        )
        self._thread = playback.supervisor.start(MEASURING, self._wait)

    @property
    def is_running(self) -> bool:
        """Whether the command still runs."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Abort the command."""
        self._command.stop()

    def _wait(self) -> None:
        code, complaint = self._command.ended()
        if code not in WHOLE:
            self._playback.supervisor.alarm(MEASURING, complaint or f"Measuring ended with exit code {code}.")
        else:
            self._playback.say("measured", f"{_words(self._command.output)} {complaint} Written to {self.folder}.")
        self._command.stop()


def _plain(name: str) -> str:
    """Reduce the name of a folder to letters, digits, dots and dashes."""
    return "".join(sign if sign.isalnum() or sign in "._-" else "_" for sign in name).strip(".") or "recording"


def _words(output: str) -> str:
    try:
        summary = json.loads(output)
        gap = summary["gap"]
        gauges = " ".join(gauge_sentence(name, gauge) for name, gauge in summary.get("gauges", {}).items())
        if summary["settings"]["fingers"] == NO_FINGERS:
            return gauges
        if not gap["count"]:
            return f"No frame has a gap. {gauges}".strip()
        return (
            f"{gap['count']} frames measured: gap {gap['least_mm']:.4f} to {gap['greatest_mm']:.4f} mm, mean "
            f"{gap['mean_mm']:.4f} mm. {gauges}".strip()
        )
    except (ValueError, LookupError, TypeError):
        return "Measured."


RANGE = "measured_range"


def _playback(view: View) -> Playback:
    if not isinstance(view, Playback):
        raise StateError("Seeking needs a recording, but this source is live: record it, and open the recording.")
    return view


def _seek(view: View, request: Request) -> Answer:
    """Show the frame of a number, or the frame nearest to a time."""
    playback = _playback(view)
    is_time = "time_s" in request
    playback.seek(playback.frame_at(number(request, "time_s")) if is_time else whole(request, "frame"))
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
