"""Gauges of the recording on the page: the list that is edited, and the thread that reads them."""

from pathlib import Path
from typing import Any, Protocol

from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.gauge_following import GaugeFollowing
from fingervision.live.playback.playback import Playback

GAUGES = "gauges"
"""Name of the feature."""


class Follows(Protocol):
    """Reads a board's gauges in the frames of a recording or of a camera."""

    @property
    def first(self) -> int | None:
        """Number of the frame that gauges are drawn in."""
        ...

    @property
    def frames(self) -> int:
        """Frames that are read."""
        ...

    @property
    def trouble(self) -> str:
        """Why there are no readings."""
        ...

    def readings(self, frame: int, version: int) -> list[dict[str, Any]] | None:
        """Give what the gauges of a version of the board say of a frame; None where that is not known."""
        ...


class GaugesBeside:
    """What the page's panel of gauges works with.

    Parameters
    ----------
    board : GaugeBoard
        The gauges and their file.
    following : Follows
        What reads them.
    is_asked_for : bool
        Whether the user asked for gauges when the page was started: the panel is open from the beginning.
    is_live : bool
        Whether the frames come from a source that goes on, where every frame is one to draw in.
    """

    def __init__(self, board: GaugeBoard, following: Follows, *, is_asked_for: bool, is_live: bool = False) -> None:
        self.board, self.following = board, following
        self.is_asked_for, self.is_live = is_asked_for, is_live
        self.is_changed_meanwhile = False
        """Whether the last wish to save found the file changed by somebody else."""


def put_gauges_beside(playback: Playback, path: Path, *, is_asked_for: bool = False) -> GaugesBeside:
    """Put gauges beside a recording, and begin to read them.

    Raises
    ------
    FingervisionError
        The file exists and cannot be meant for these frames.
    """
    description = playback.description
    board = GaugeBoard(path, (description.width_px, description.height_px))
    following = GaugeFollowing(playback, board)
    beside = GaugesBeside(board, following, is_asked_for=is_asked_for)
    playback.features[GAUGES] = beside
    playback.on_stop.append(following.stop)
    following.start()
    return beside
