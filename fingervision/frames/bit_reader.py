"""Read the header of a coded stream bit by bit, one field after another."""

MOST_ZEROS = 32


class BitReader:
    """Reads unsigned numbers from the start of a byte string, most significant bit first.

    Parameters
    ----------
    content : bytes
        Bytes of the header.
    """

    def __init__(self, content: bytes) -> None:
        self._bits, self._left = int.from_bytes(content, "big"), 8 * len(content)

    def take(self, count: int) -> int:
        """Read a number of `count` bits; raise IndexError after the end."""
        self._left -= count
        if self._left < 0:
            raise IndexError
        return (self._bits >> self._left) & ((1 << count) - 1)

    def golomb(self) -> int:
        """Read a number in Exp-Golomb code (ITU-T H.264, 9.1; `uvlc` of AV1)."""
        rest = self._bits & ((1 << self._left) - 1)
        zeros = self._left - rest.bit_length()
        if zeros > MOST_ZEROS:
            raise ValueError
        return self.take(2 * zeros + 1) - 1
