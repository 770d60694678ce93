"""Check that a JPEG contains exactly the blocks that it states, by a second decoder that reports what FFmpeg ignores.

Damage in a JPEG changes how the following Huffman codes are read, and often leaves too few or too many bytes at the end
of the picture, or of the part before a restart marker. (After a single flipped bit the codes often fit again within a
few blocks: the visible error is judged by `measuring.sound_picture`.) FFmpeg fills missing blocks with whatever was in
memory and ignores surplus bytes; libjpeg-turbo reports both (warnings JWRN_HIT_MARKER and JWRN_EXTRANEOUS_DATA, ITU-T
T.81, F.2.2.5 and E.2.4).
"""

import re
from collections import Counter
from collections.abc import Iterable

import simplejpeg

# Scale factor of the decoded picture: at 1/8 only the DC coefficients are rendered, which saves time, although every
# code is read.
SMALLEST = 8
# Number of pictures from which it is learnt whether this camera violates the format in every picture, as some cameras
# do.
PICTURES_TO_LEARN = 16
# Beginning of the words about a header that cannot be read; a camera writes the same header in every picture.
HEADER = "tjDecompressHeader"


class SoundJpeg:
    """Checks the pictures of one Motion JPEG stream for missing or surplus data.

    A camera that violates the format does so in the same way in every picture, and damage in many ways: a fault of a
    kind that most pictures of the stream have is the camera's own, and is not reported, nor is a header that no picture
    of the stream has better.

    Parameters
    ----------
    codec : str
        FFmpeg's name of the codec; streams of other codecs than Motion JPEG are not checked.
    """

    def __init__(self, codec: str) -> None:
        self._is_one = codec == "mjpeg"
        self._kinds: Counter[str] = Counter()

    def learn(self, pictures: Iterable[bytes]) -> None:
        """Examine some pictures in advance, to learn which properties are usual for the stream."""
        if self._is_one:
            for picture, _ in zip(pictures, range(PICTURES_TO_LEARN), strict=False):
                self._kinds[_kind(_fault(picture))] += 1

    def fault(self, picture: bytes) -> str:
        """Describe a picture's fault; empty if it has none.

        Parameters
        ----------
        picture : bytes
            Bytes of one packet of the stream.
        """
        if not self._is_one:
            return ""
        fault = _fault(picture)
        kind = _kind(fault)
        self._kinds[kind] += 1
        is_own = not self._kinds[""] if kind.startswith(HEADER) else 2 * self._kinds[kind] > self._kinds.total()
        return "" if is_own else fault


def _fault(picture: bytes) -> str:
    try:
        simplejpeg.decode_jpeg(picture, "GRAY", min_factor=SMALLEST, fastdct=True, fastupsample=True, strict=True)
    except ValueError as error:
        return str(error).removeprefix("Corrupt JPEG data: ")
    return ""


def _kind(fault: str) -> str:
    """Fault without its numbers, which differ from picture to picture."""
    return re.sub(r"\d+", "", fault)
