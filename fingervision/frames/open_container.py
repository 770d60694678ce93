"""Open a file with FFmpeg by its exact name, whatever characters the name and the file's metadata contain."""

from pathlib import Path
from typing import Any

import av

# PyAV 19 reads any byte of the metadata; earlier versions stop at invalid UTF-8 unless they are told otherwise.
WHATEVER_METADATA: dict[str, Any] = {} if int(av.__version__.split(".")[0]) >= 19 else {"metadata_errors": "replace"}


def open_container(path: str | Path) -> av.container.InputContainer:
    """Open a media file for reading.

    FFmpeg interprets text before a colon in a name as a protocol; the name is therefore given after `file:`, so that
    `12:30:05.mp4` is read as a file. Metadata that are not valid UTF-8, such as a title with a damaged byte, do not
    matter, because no picture depends on them.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    av.FFmpegError, OSError
        If the file cannot be opened, or is of no format that FFmpeg reads.
    """
    container: av.container.InputContainer = av.open(f"file:{path}", **WHATEVER_METADATA)
    return container
