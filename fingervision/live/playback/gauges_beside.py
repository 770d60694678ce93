"""Gauges of a recording in the page: the list that is edited, and the thread that measures them."""

from pathlib import Path
from typing import Any, Protocol

from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.gauge_following import GaugeFollowing
from fingervision.live.playback.playback import Playback

GAUGES = "gauges"
"""Name of the feature."""


class Follows(Protocol):
    """Measures a board's gauges in the frames of a recording or a camera."""

    @property
    def first(self) -> int | None:
        """Number of the frame in which gauges are drawn."""
        ...

    @property
    def frames(self) -> int:
        """Number of frames measured so far."""
        ...

    @property
    def trouble(self) -> str:
        """Reason why there are no readings."""
        ...

    def readings(self, frame: int, version: int) -> list[dict[str, Any]] | None:
        """Readings of one version of the board's gauges in a frame; None where they are unknown."""
        ...


class GaugesBeside:
    """Data for the page's panel of gauges.

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
    """Add gauges to a recording, and begin to measure them.

    Raises
    ------
    DataError, InputFileError
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
