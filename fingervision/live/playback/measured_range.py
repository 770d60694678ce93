"""Measurement of a range of a recording by the command `measure`, whose results are saved."""

import json
from pathlib import Path
from time import sleep

from fingervision.domain.errors import StateError
from fingervision.live.background import WAITED_FOR, BackgroundCommand
from fingervision.live.playback.gauges_beside import GAUGES, GaugesBeside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.track import WHOLE, arguments_of

LOOK_EVERY_S = 0.1
RANGE = "Measuring a range"


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
        self._thread = playback.supervisor.start(RANGE, self._wait)

    @property
    def is_running(self) -> bool:
        """Whether the command still runs."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Abort the command."""
        self._command.stop()

    def _wait(self) -> None:
        while self._command.exit_code is None:
            sleep(LOOK_EVERY_S)
        code, complaint = self._command.exit_code, self._command.complaint
        if code not in WHOLE:
            self._playback.supervisor.alarm(RANGE, complaint or f"Measuring ended with exit code {code}.")
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
        if not gap["count"]:
            return "No frame has a gap."
        return (
            f"{gap['count']} frames measured: gap {gap['least_mm']:.4f} to {gap['greatest_mm']:.4f} mm, mean "
            f"{gap['mean_mm']:.4f} mm."
        )
    except (ValueError, LookupError, TypeError):
        return "Measured."
