"""Gauges in the browser page: the list that the user edits, and the measurement of the listed gauges."""

from pathlib import Path
from typing import TYPE_CHECKING

from fingervision.live.playback.gauge_board import GaugeBoard
from fingervision.live.playback.gauge_following import GaugeFollowing
from fingervision.live.playback.playback import Playback

if TYPE_CHECKING:
    from fingervision.live.live_gauges import LiveGauges

GAUGES = "gauges"
"""Name of this addition in the features of a view."""


class GaugesBeside:
    """Data for the gauge panel in the browser page.

    Parameters
    ----------
    board : GaugeBoard
        The gauges and their file.
    following : GaugeFollowing or LiveGauges
        Measurement of the gauges in the frames of a recording or a camera.
    is_asked_for : bool
        Whether the user requested gauges on the command line, so that the panel is open from the beginning.
    is_live : bool
        Whether the frames come from a continuous source, in which gauges can be drawn in any frame.
    """

    def __init__(
        self, board: GaugeBoard, following: "GaugeFollowing | LiveGauges", *, is_asked_for: bool, is_live: bool = False
    ) -> None:
        self.board, self.following = board, following
        self.is_asked_for, self.is_live = is_asked_for, is_live
        self.is_changed_meanwhile = False
        """Whether the last request to save failed because another program had changed the file."""


def put_gauges_beside(playback: Playback, path: Path, *, is_asked_for: bool = False) -> GaugesBeside:
    """Add gauges to the playback of a recording, and start to measure them.

    Raises
    ------
    DataError, InputFileError
        The file exists but cannot be read, or its gauges do not fit these frames.
    """
    description = playback.description
    board = GaugeBoard(path, (description.width_px, description.height_px))
    following = GaugeFollowing(playback, board)
    beside = GaugesBeside(board, following, is_asked_for=is_asked_for)
    playback.features[GAUGES] = beside
    playback.on_stop.append(following.stop)
    following.start()
    return beside
