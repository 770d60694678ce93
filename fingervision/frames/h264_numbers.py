"""Numbers that H.264 stores in front of every picture, by which a lost picture is detected."""

from dataclasses import dataclass

from fingervision.frames.bit_reader import BitReader

# Types of NAL units (ITU-T H.264, table 7-1).
PICTURE, KEY_PICTURE, SUPPLEMENT, SEQUENCE, PICTURE_SET = 1, 5, 6, 7, 8
RECOVERY_POINT = 6
# Profiles whose sequence parameters contain the chroma format (7.3.2.1.1).
HIGH_PROFILES = frozenset({44, 83, 86, 100, 110, 118, 122, 128, 134, 135, 138, 139, 244})
# Number of bytes of a unit that are read, which is more than any header needs.
HEADER_BYTES = 96
INTRA_SLICES = frozenset({2, 7})


@dataclass(frozen=True, slots=True)
class CodedPicture:
    """Content of a picture's first slice header.

    Parameters
    ----------
    is_key : bool
        Whether decoding can start with this picture (an instantaneous decoding refresh), at which the numbers start
        again.
    is_reference : bool
        Whether other pictures may depend on this one.
    is_field : bool
        Whether the picture is a field (every second line).
    is_intra : bool
        Whether the picture's first slice depends on no other picture.
    number : int
        `frame_num`: one more than that of the preceding reference picture, modulo `modulus`.
    modulus : int
        2 ** log2_max_frame_num.
    may_leap : bool
        Whether the stream allows gaps in the numbers (removed temporal layers).
    recovers_after : int or None
        For a picture with a recovery point, the number of reference pictures after which all pictures are exact; else
        None.
    """

    is_key: bool
    is_reference: bool
    is_field: bool
    is_intra: bool
    number: int
    modulus: int
    may_leap: bool
    recovers_after: int | None = None


@dataclass(frozen=True, slots=True)
class _Sequence:
    number_bits: int
    may_leap: bool
    frames_only: bool
    separate_colours: bool


class H264Numbers:
    """Reader of slice headers (ITU-T H.264, 7.3.3), which stores the parameter sets to which they refer.

    Parameters
    ----------
    extradata : bytes or None
        Parameter sets of the container: `avcC` (ISO/IEC 14496-15, 5.3.3) or a byte stream (annex B).
    """

    def __init__(self, extradata: bytes | None) -> None:
        self._sequences: dict[int, _Sequence] = {}
        self._sequence_of: dict[int, int] = {}
        self._length_bytes = 0  # bytes of the length in front of every unit; 0 if units are separated by start codes
        extradata = extradata or b""
        if len(extradata) > 6 and extradata[0] == 1:
            self._length_bytes = (extradata[4] & 3) + 1
            for unit in _of_avcc(extradata):
                self._learn(unit)
        else:
            for unit in _between_start_codes(extradata):
                self._learn(unit)

    def of(self, packet: bytes) -> CodedPicture | None:
        """Read the first slice header in a packet; return None if the packet contains no readable picture."""
        recovers_after = None
        try:
            units = _after_lengths(packet, self._length_bytes) if self._length_bytes else _between_start_codes(packet)
            for unit in units:
                kind = unit[0] & 0x1F
                if kind in (SEQUENCE, PICTURE_SET):
                    self._learn(unit)
                elif kind == SUPPLEMENT:
                    recovers_after = _recovery(unit)
                elif kind in (PICTURE, KEY_PICTURE):
                    return self._picture(unit, recovers_after)
        except (IndexError, KeyError, ValueError):
            return None
        return None

    def _learn(self, unit: bytes) -> None:
        bits = _bits(unit)
        try:
            if unit[0] & 0x1F == SEQUENCE:
                name, sequence = _sequence(bits)
                self._sequences[name] = sequence
            elif unit[0] & 0x1F == PICTURE_SET:
                name = bits.golomb()
                self._sequence_of[name] = bits.golomb()
        except (IndexError, ValueError):
            return

    def _picture(self, unit: bytes, recovers_after: int | None) -> CodedPicture:
        bits = _bits(unit)
        bits.golomb()  # number of the slice's first macroblock
        is_intra = bits.golomb() in INTRA_SLICES
        sequence = self._sequences[self._sequence_of[bits.golomb()]]
        if sequence.separate_colours:
            bits.take(2)
        number = bits.take(sequence.number_bits)
        is_field = not sequence.frames_only and bool(bits.take(1))
        return CodedPicture(
            is_key=unit[0] & 0x1F == KEY_PICTURE,
            is_reference=bool(unit[0] & 0x60),
            is_field=is_field,
            is_intra=is_intra,
            number=number,
            modulus=1 << sequence.number_bits,
            may_leap=sequence.may_leap,
            recovers_after=recovers_after,
        )


def _bits(unit: bytes) -> BitReader:
    """Bits of an H.264 unit after its first byte, without the emulation prevention bytes (ITU-T H.264, 7.3.1)."""
    return BitReader(unit[1 : 1 + HEADER_BYTES].replace(b"\0\0\3", b"\0\0"))


def _sequence(bits: BitReader) -> tuple[int, _Sequence]:
    """Read the sequence parameters (ITU-T H.264, 7.3.2.1.1) as far as they are needed."""
    profile = bits.take(8)
    bits.take(16)
    name = bits.golomb()
    separate = False
    if profile in HIGH_PROFILES:
        colours = bits.golomb()
        separate = colours == 3 and bool(bits.take(1))
        bits.golomb()
        bits.golomb()
        bits.take(1)
        if bits.take(1):
            for k in range(12 if colours == 3 else 8):
                if bits.take(1):
                    _skip_scaling(bits, 16 if k < 6 else 64)
    number_bits = bits.golomb() + 4
    order = bits.golomb()
    if order == 0:
        bits.golomb()
    elif order == 1:
        bits.take(1)
        bits.golomb()
        bits.golomb()
        for _ in range(bits.golomb()):
            bits.golomb()
    bits.golomb()
    may_leap = bool(bits.take(1))
    bits.golomb()
    bits.golomb()
    return name, _Sequence(number_bits, may_leap, bool(bits.take(1)), separate)


def _skip_scaling(bits: BitReader, count: int) -> None:
    last = following = 8
    for _ in range(count):
        if following:
            code = bits.golomb()
            following = (last + ((code + 1) // 2 if code % 2 else -code // 2)) % 256
        last = following or last


def _recovery(unit: bytes) -> int | None:
    """Number of frames until pictures are exact after a recovery point; None if there is no such point (D.1.8)."""
    content = unit.replace(b"\0\0\3", b"\0\0")
    at = 1
    while at + 2 < len(content):
        kind = size = 0
        while content[at] == 255:
            kind, at = kind + 255, at + 1
        kind, at = kind + content[at], at + 1
        while content[at] == 255:
            size, at = size + 255, at + 1
        size, at = size + content[at], at + 1
        if kind == RECOVERY_POINT:
            bits = _bits(b"\6" + content[at : at + size])
            count, is_exact, is_broken = bits.golomb(), bits.take(1), bits.take(1)
            return count if is_exact and not is_broken else None
        at += size
    return None


def _between_start_codes(content: bytes) -> "list[bytes]":
    units = content.split(b"\0\0\1")[1:]
    return [unit for unit in units if unit]


def _after_lengths(content: bytes, length_bytes: int) -> "list[bytes]":
    units, at = [], 0
    while at + length_bytes < len(content):
        size = int.from_bytes(content[at : at + length_bytes], "big")
        at += length_bytes
        if not size or at + size > len(content):
            raise ValueError
        units.append(content[at : at + size])
        at += size
    return units


def _of_avcc(record: bytes) -> "list[bytes]":
    """Parameter sets of a decoder configuration record."""
    units, at = [], 5
    for mask in (0x1F, 0xFF):
        if at >= len(record):
            break
        count, at = record[at] & mask, at + 1
        for _ in range(count):
            size = int.from_bytes(record[at : at + 2], "big")
            unit = record[at + 2 : at + 2 + size]
            if unit:
                units.append(unit)
            at += 2 + size
    return units
