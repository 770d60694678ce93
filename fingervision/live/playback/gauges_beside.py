"""Gauges beside a recording: the board that the page works on, and the thread that reads it."""

from pathlib import Path

from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.gauge_following import GaugeFollowing
from fingervision.live.playback.playback import Playback

GAUGES = "gauges"
"""Name of the feature."""


class GaugesBeside:
    """What the page's panel of gauges works with.

    Parameters
    ----------
    playback : Playback
        The recording.
    path : Path
        File of the gauges.
    is_asked_for : bool
        Whether the user asked for gauges when the page was started: the panel is open from the beginning.

    Raises
    ------
    FingervisionError
        The file exists and cannot be meant for these frames.
    """

    def __init__(self, playback: Playback, path: Path, *, is_asked_for: bool) -> None:
        description = playback.description
        self.board = GaugeBoard(path, (description.width_px, description.height_px))
        self.following = GaugeFollowing(playback, self.board)
        self.is_asked_for = is_asked_for
        self.is_changed_meanwhile = False
        """Whether the last wish to save found the file changed by somebody else."""


def put_gauges_beside(playback: Playback, path: Path, *, is_asked_for: bool = False) -> GaugesBeside:
    """Put gauges beside a recording, and begin to read them.

    Raises
    ------
    FingervisionError
        The file exists and cannot be meant for these frames.
    """
    beside = GaugesBeside(playback, path, is_asked_for=is_asked_for)
    playback.features[GAUGES] = beside
    playback.on_stop.append(beside.following.stop)
    beside.following.start()
    return beside
