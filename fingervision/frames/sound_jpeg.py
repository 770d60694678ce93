"""Check that a JPEG contains exactly the blocks that it states, by a second decoder that reports what FFmpeg ignores.

Damage in a JPEG changes how the following Huffman codes are read, and often leaves too few or too many bytes at the end
of the picture, or of the part before a restart marker. (After a single flipped bit the codes often fit again within a
few blocks: the visible error is judged by `measuring.sound_picture`.) FFmpeg fills missing blocks with whatever was in
memory and ignores surplus bytes; libjpeg-turbo reports both (warnings JWRN_HIT_MARKER and JWRN_EXTRANEOUS_DATA, ITU-T
T.81, F.2.2.5 and E.2.4).
"""

from collections.abc import Iterable

import simplejpeg

# Scale factor of the decoded picture: at 1/8 only the DC coefficients are rendered, which saves time, although every
# code is read.
SMALLEST = 8
# Number of pictures from which it is learnt whether this camera violates the format in every picture, as some cameras
# do.
PICTURES_TO_LEARN = 16


class SoundJpeg:
    """Checks the pictures of one Motion JPEG stream for missing or surplus data.

    A fault is reported only if most pictures of the stream have none; if most have a fault, the camera itself writes
    such pictures.

    Parameters
    ----------
    codec : str
        FFmpeg's name of the codec; streams of other codecs than Motion JPEG are not checked.
    """

    def __init__(self, codec: str) -> None:
        self._is_one = codec == "mjpeg"
        self._sound = self._unsound = 0

    def learn(self, pictures: Iterable[bytes]) -> None:
        """Examine some pictures in advance, to learn which properties are usual for the stream."""
        if self._is_one:
            for picture, _ in zip(pictures, range(PICTURES_TO_LEARN), strict=False):
                self._count(not _fault(picture))

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
