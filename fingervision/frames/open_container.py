"""Open a file with FFmpeg by its exact name, whatever characters the name and the file's metadata contain."""

from pathlib import Path

import av


def open_container(path: str | Path) -> av.container.InputContainer:
    """Open a media file for reading.

    FFmpeg interprets text before a colon in a name as a protocol; the name is therefore given after `file:`, so that
    `12:30:05.mp4` is read as a file. Metadata that are not valid UTF-8, such as a title with a damaged byte, are read
    with the replacement character, because no picture depends on them.

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
