"""Data that MPEG-4 part 2 stores in front of every picture: its type, and a bit that encoders toggle.

Half-pixel values are rounded up in one P picture and down in the next, so that rounding errors do not accumulate
(`vop_rounding_type`). Encoders toggle the bit `vop_rounding_type` with every P picture and reset it at each I picture,
so that the bit counts modulo two and reveals one missing picture.

Source: ISO/IEC 14496-2, 6.2.3 (video object layer), 6.2.5 (video object plane), 6.3.5.
"""

from dataclasses import dataclass
from enum import Enum

from fingervision.frames.bit_reader import BitReader

LAYER_CODES = range(0x20, 0x30)
PLANE_CODE = 0xB6
EXTENDED_PIXEL_SHAPE, RECTANGULAR = 15, 0
BUFFER_PARAMETER_BITS = 79
# Number of bytes of a unit that are read, which is more than any header needs.
HEADER_BYTES = 64
# Largest number of seconds since the previous picture; the header has one bit for each second.
MOST_SECONDS = 3600


class Mpeg4Kind(Enum):
    """Type of an MPEG-4 picture by its dependence on other pictures (`vop_coding_type`)."""

    I_PICTURE = 0
    P_PICTURE = 1
    B_PICTURE = 2
    SPRITE = 3


@dataclass(frozen=True, slots=True)
class Mpeg4Picture:
    """Content of the header of an MPEG-4 picture.

    Parameters
    ----------
    kind : Mpeg4Kind
        Type of the picture, by its dependence on others.
    rounding : int or None
        `vop_rounding_type`, 0 or 1; None if the header does not contain it.
    """

    kind: Mpeg4Kind
    rounding: int | None


class Mpeg4Headers:
    """Reader of the headers of MPEG-4 pictures, which stores the header format from the layer's header.

    Parameters
    ----------
    extradata : bytes or None
        The container's copy of the layer's header.
    """

    def __init__(self, extradata: bytes | None) -> None:
        self._increment_bits: int | None = None
        self._units(extradata or b"")

    def of(self, packet: bytes) -> Mpeg4Picture | None:
        """Read the first picture header of a packet; return None if the packet contains no readable header."""
        return self._units(packet)

    def _units(self, content: bytes) -> Mpeg4Picture | None:
        for unit in content.split(b"\0\0\1")[1:]:
            if not unit:
                continue
            try:
                if unit[0] in LAYER_CODES:
                    self._increment_bits = _increment_bits(unit[1:HEADER_BYTES])
                elif unit[0] == PLANE_CODE:
                    return self._plane(unit[1:HEADER_BYTES])
            except IndexError:
                return None
        return None

    def _plane(self, header: bytes) -> Mpeg4Picture | None:
        bits = BitReader(header)
        kind = Mpeg4Kind(bits.take(2))
        if self._increment_bits is None:
            return Mpeg4Picture(kind, None)
        seconds = 0
        while bits.take(1):
            seconds += 1
            if seconds > MOST_SECONDS:
                return None
        bits.take(1 + self._increment_bits + 1)
        is_coded = bits.take(1)
        return Mpeg4Picture(kind, bits.take(1) if is_coded and kind is Mpeg4Kind.P_PICTURE else None)


def _increment_bits(header: bytes) -> int | None:
    """Length of `vop_time_increment` from a layer's header; None for shapes other than a rectangle."""
    bits = BitReader(header)
    bits.take(1 + 8)
    if bits.take(1):
        bits.take(4 + 3)
    if bits.take(4) == EXTENDED_PIXEL_SHAPE:
        bits.take(8 + 8)
    if bits.take(1):
        bits.take(2 + 1)
        if bits.take(1):
            bits.take(BUFFER_PARAMETER_BITS)
    if bits.take(2) != RECTANGULAR:
        return None
    bits.take(1)
    return max(1, (bits.take(16) - 1).bit_length())
