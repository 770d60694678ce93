"""Open a source by name; cameras and streams are opened again after an interruption, files are not."""

from typing import cast

from fingervision.domain.errors import UsageError
from fingervision.frames import camera
from fingervision.frames.network_stream import without_password
from fingervision.frames.received import LiveSource
from fingervision.frames.source import CameraWish, Wish, open_source
from fingervision.live.capture import Capture
from fingervision.live.paced import PacedRecording


def opened(name: str, wish: Wish) -> Capture:
    """Open a source for a live view.

    Raises
    ------
    DataError, DeviceError, InputFileError
        The source cannot be opened.
    UsageError
        Camera settings are given for a source that is not a camera of this machine.
    """
    if wish.camera != CameraWish() and not camera.accepts(name):
        raise UsageError(
            "--format, --exposure-ms, --gain, --focus and --white-balance-k are for cameras of this computer, but "
            f"{without_password(name)} is not one: leave them out."
        )
    source = open_source(name, wish)
    if not hasattr(source, "received"):
        if wish.size_px is not None:
            raise UsageError(f"--size is for cameras, but {name} is a recording: leave it out.")
        return Capture(PacedRecording(source), again=None)
    return Capture(cast("LiveSource", source), again=lambda: cast("LiveSource", open_source(name, wish)))
