"""Numbers that AV1 stores in front of every picture: the order in which pictures are presented.

Source: Alliance for Open Media, AV1 Bitstream and Decoding Process Specification (2019), 5.3 (OBU), 5.5 (sequence
header), 5.9.2 (frame header), 7.20 (reference frame update).
"""

from dataclasses import dataclass

from fingervision.frames.bit_reader import BitReader

SEQUENCE, FRAME_HEADER, FRAME = 1, 3, 6
KEY_FRAME, INTRA_ONLY_FRAME, SWITCH_FRAME = 0, 2, 3
SLOTS, ALL_SLOTS = 8, 0xFF
SELECT_SCREEN_CONTENT = 2
# Number of bytes of a packet that are read, which is more than any header needs.
HEADER_BYTES = 160


@dataclass(frozen=True, slots=True)
class ShownPicture:
    """Information that an AV1 packet contains on the picture that it presents.

    Parameters
    ----------
    is_key : bool
        Whether decoding can start with this picture.
    order : int
        `order_hint`: one more than that of the previously presented picture, modulo `modulus`.
    modulus : int
        2 ** OrderHintBits.
    """

    is_key: bool
    order: int
    modulus: int


@dataclass(frozen=True, slots=True)
class _Sequence:
    order_bits: int  # 0 if pictures have no numbers
    screen_content: int
    integer_motion: int
    id_bits: int


class Av1Order:
    """Reader of AV1 frame headers, which stores the sequence header and the content of the eight reference slots.

    Parameters
    ----------
    extradata : bytes or None
        The container's `av1C` record (four bytes, then OBUs), or nothing.
    """

    def __init__(self, extradata: bytes | None) -> None:
        self._sequence: _Sequence | None = None
        self._slots: list[tuple[int, bool] | None] = [
            None
        ] * SLOTS  # for each slot: picture number, and whether the picture is a key frame that is yet to be shown
        if extradata is not None and len(extradata) > 4 and extradata[0] == 0x81:
            self.of(extradata[4:])

    def of(self, packet: bytes) -> ShownPicture | None:
        """Read a packet; return None if the packet presents no picture, or a picture without a number."""
        shown: ShownPicture | None = None
        try:
            for kind, content in _units(packet):
                if kind == SEQUENCE:
                    self._sequence = _sequence(BitReader(content[:HEADER_BYTES]))
                elif kind in (FRAME_HEADER, FRAME) and self._sequence is not None:
                    shown = self._picture(BitReader(content[:HEADER_BYTES]), self._sequence) or shown
        except IndexError:
            return None
        return shown

    def _picture(self, bits: BitReader, sequence: _Sequence) -> ShownPicture | None:
        if not sequence.order_bits:
            return None
        modulus = 1 << sequence.order_bits
        if bits.take(1):
            existing = self._slots[bits.take(3)]
            if existing is None:
                return None
            if existing[1]:
                self._slots = [existing] * SLOTS
            return ShownPicture(is_key=existing[1], order=existing[0], modulus=modulus)
        kind, is_shown = bits.take(2), bool(bits.take(1))
        if not is_shown:
            bits.take(1)
        is_resilient = kind == SWITCH_FRAME or (kind == KEY_FRAME and is_shown) or bool(bits.take(1))
        bits.take(1)
        screen = bits.take(1) if sequence.screen_content == SELECT_SCREEN_CONTENT else sequence.screen_content
        if screen and sequence.integer_motion == SELECT_SCREEN_CONTENT:
            bits.take(1)
        bits.take(sequence.id_bits)
        if kind != SWITCH_FRAME:
            bits.take(1)
        order = bits.take(sequence.order_bits)
        if kind not in (KEY_FRAME, INTRA_ONLY_FRAME) and not is_resilient:
            bits.take(3)
        refreshed = ALL_SLOTS if kind == SWITCH_FRAME or (kind == KEY_FRAME and is_shown) else bits.take(8)
        for slot in range(SLOTS):
            if refreshed >> slot & 1:
                self._slots[slot] = order, kind == KEY_FRAME and not is_shown
        return ShownPicture(is_key=kind == KEY_FRAME, order=order, modulus=modulus) if is_shown else None


def _units(packet: bytes) -> list[tuple[int, bytes]]:
    """Bitstream units (OBUs) of a packet: kind and content of each."""
    units, at = [], 0
    while at < len(packet):
        header = packet[at]
        at += 2 if header & 4 else 1
        if header & 2:
            size, shift = 0, 0
            while True:
                byte, at = packet[at], at + 1
                size, shift = size | (byte & 0x7F) << shift, shift + 7
                if not byte & 0x80 or shift > 56:
                    break
        else:
            size = len(packet) - at
        units.append((header >> 3 & 15, packet[at : at + size]))
        at += size
    return units


def _sequence(bits: BitReader) -> _Sequence | None:
    """Read a sequence header as far as the length of the frame numbers; None if frame headers contain decoder times."""
    bits.take(3 + 1)
    if bits.take(1):
        return None  # a still picture
    if bits.take(1):  # timing
        bits.take(32)
        bits.take(32)
        if bits.take(1):
            bits.golomb()
        if bits.take(1):
            return None
    has_delay = bits.take(1)
    for _ in range(bits.take(5) + 1):
        bits.take(12)
        if bits.take(5) > 7:
            bits.take(1)
        if has_delay and bits.take(1):
            bits.take(4)
    width_bits, height_bits = bits.take(4) + 1, bits.take(4) + 1
    bits.take(width_bits + height_bits)
    id_bits = 0
    if bits.take(1):
        difference_bits = bits.take(4) + 2
        id_bits = bits.take(3) + difference_bits + 1
    bits.take(3 + 4)
    order_bits = 0
    has_order = bits.take(1)
    if has_order:
        bits.take(2)
    screen_content = SELECT_SCREEN_CONTENT if bits.take(1) else bits.take(1)
    integer_motion = SELECT_SCREEN_CONTENT
    if screen_content and not bits.take(1):
        integer_motion = bits.take(1)
    if has_order:
        order_bits = bits.take(3) + 1
    return _Sequence(order_bits, screen_content, integer_motion, id_bits)
