"""From a source's name to the capture: cameras and streams open again after a cut, files do not."""

from typing import cast

from fingervision.frames.received import LiveSource
from fingervision.frames.source import Wish, open_source
from fingervision.live.capture import Capture
from fingervision.live.paced import PacedRecording


def opened(name: str, wish: Wish) -> Capture:
    """Open a source for a live view.

    Raises
    ------
    FingervisionError
        It cannot be opened.
    """
    source = open_source(name, wish)
    if not hasattr(source, "received"):
        return Capture(PacedRecording(source), again=None)
    return Capture(cast("LiveSource", source), again=lambda: cast("LiveSource", open_source(name, wish)))
