"""Whether a JPEG holds exactly the blocks that it states: a second decoder is asked, which says what FFmpeg lets pass.

Damage in a JPEG lets the Huffman codes behind it be read otherwise, and often too few or too many bytes are left where
the picture, or the part of it before a restart marker, is full. (A single flipped bit is often caught up with within a
few blocks: what it draws is judged by `measuring.sound_picture`.) FFmpeg fills what is missing with
what was in memory and leaves the rest; libjpeg-turbo counts both (warnings JWRN_HIT_MARKER and JWRN_EXTRANEOUS_DATA,
ITU-T T.81, F.2.2.5 and E.2.4).
"""

from collections.abc import Iterable

import simplejpeg

# The DC part alone is drawn: every code is read all the same, and nothing is spent on pixels that nobody looks at.
SMALLEST = 8
# Some cameras break the format in every picture, with bytes of their own. So many pictures show whether this one does.
PICTURES_TO_LEARN = 16


class SoundJpeg:
    """Judges the pictures of one Motion JPEG stream.

    What is said of a picture is believed only as long as most pictures of the stream are sound: otherwise the camera
    writes them so.

    Parameters
    ----------
    codec : str
        FFmpeg's name of the codec; of another than Motion JPEG nothing is said.
    """

    def __init__(self, codec: str) -> None:
        self._is_one = codec == "mjpeg"
        self._sound = self._unsound = 0

    def learn(self, pictures: Iterable[bytes]) -> None:
        """Look at a few pictures beforehand."""
        if self._is_one:
            for picture, _ in zip(pictures, range(PICTURES_TO_LEARN), strict=False):
                self._count(not _fault(picture))

    def fault(self, picture: bytes) -> str:
        """Say what is wrong with a picture; empty where nothing is.

        Parameters
        ----------
        picture : bytes
            One packet of the stream.
        """
        if not self._is_one:
            return ""
        fault = _fault(picture)
        believed = self._sound >= self._unsound
        self._count(not fault)
        return fault if believed else ""

    def _count(self, is_sound: bool) -> None:
        self._sound += is_sound
        self._unsound += not is_sound


def _fault(picture: bytes) -> str:
    try:
        simplejpeg.decode_jpeg(picture, "GRAY", min_factor=SMALLEST, fastdct=True, fastupsample=True, strict=True)
    except ValueError as error:
        return str(error).removeprefix("Corrupt JPEG data: ")
    return ""
