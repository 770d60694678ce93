"""Open a file with FFmpeg by its exact name, whatever characters the name and the file's metadata contain."""

from pathlib import Path

import av


def open_container(path: str | Path) -> av.container.InputContainer:
    """Open a media file for reading.

    FFmpeg takes what precedes a colon in a name for a protocol, so that the name follows `file:` (`12:30:05.mp4` is a
    file). Metadata that are not valid UTF-8, as a damaged byte in a title leaves them, are read with the replacement
    character, since no picture depends on them.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    av.FFmpegError, OSError
        If the file cannot be opened, or is of no format that FFmpeg reads.
    """
    return av.open(f"file:{path}", metadata_errors="replace")
