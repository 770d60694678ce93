"""Open a file with FFmpeg by its exact name, and collect the damage that FFmpeg reports only in its log."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import av

# A damaged slice raises an error instead of being replaced by the previous picture, and existing checksums are
# verified.
STRICT = {"err_detect": "crccheck+explode"}
# Errors in headers that do not affect pixels; cheap cameras write such headers into every picture.
HARMLESS = ("unable to decode APP",)
# Message of the H.264 decoder, at the level for developers, that the number of a picture does not follow the last one.
LEAPS = "Frame num gap"
# Other sources of messages at this level are FFmpeg's helpers (scaling, the log itself), which do not concern the
# stream.
HELPERS = ("swscaler", "swresampler", "")


@dataclass(slots=True)
class Heard:
    """Errors that FFmpeg has logged since they were last requested.

    Decoders replace a damaged part by the previous picture, and container readers skip to the next place that looks
    undamaged. Most damage that FFmpeg conceals is only logged, and never returned to the caller as an error.

    Parameters
    ----------
    decoder : str
        Name of the decoder; messages under other names are from the container reader.
    warnings : tuple of str
        Beginnings of warnings by the container reader that also indicate damage.
    """

    decoder: str
    warnings: tuple[str, ...] = ()
    log: list[tuple[int, str, str]] = field(default_factory=list)
    has_leapt: bool = False
    """Whether the decoder mentioned a gap in the numbers of pictures in its last messages."""

    def of_picture(self) -> str:
        """Return the first message of the decoder, and delete all of its messages; empty if there is no message."""
        self.has_leapt = any(speaker == self.decoder and words.startswith(LEAPS) for _, speaker, words in self.log)
        said = [
            words.strip() for level, speaker, words in self.log if speaker == self.decoder and level <= av.logging.ERROR
        ]
        said = [words for words in said if words and not words.startswith(HARMLESS)]
        self.log.clear()
        return said[0].rstrip(".") if said else ""

    def of_file(self) -> str:
        """Return and delete the container reader's messages; the decoder's messages are kept."""
        said = [
            words.strip()
            for level, speaker, words in self.log
            if speaker not in (self.decoder, *HELPERS)
            and (level <= av.logging.ERROR or words.startswith(self.warnings))
        ]
        self.log[:] = [entry for entry in self.log if entry[1] == self.decoder]
        return said[0].rstrip(".") if said else ""


@contextmanager
def listening(decoder: str, warnings: tuple[str, ...] = ()) -> Iterator[Heard]:
    """Collect FFmpeg's error log, and keep it off the screen."""
    before, were_skipped = av.logging.get_level(), av.logging.get_skip_repeated()
    plain = av.logging.WARNING if warnings else av.logging.ERROR
    av.logging.set_skip_repeated(False)  # the damage that was heard last may be met again, by another pass over a file
    av.logging.set_level(av.logging.DEBUG if decoder == "h264" else plain)
    try:
        # The log of all threads is collected, because FFmpeg decodes slices in its own threads.
        with av.logging.Capture(local=False) as log:
            yield Heard(decoder, warnings, log)
    finally:
        av.logging.set_level(before)
        av.logging.set_skip_repeated(were_skipped)


# Open a file with FFmpeg by its exact name, whatever characters the name and the file's metadata contain.

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
