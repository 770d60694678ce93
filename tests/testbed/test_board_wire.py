"""The serial protocol of the board: intact messages are read, and damaged messages are rejected."""

from hypothesis import given
from hypothesis import strategies as st

from fingervision.testbed.board.wire import (
    Answer,
    Change,
    Identity,
    Levels,
    Message,
    Refusal,
    Sample,
    Unwrapped,
    decoded,
    encoded,
)

bytes_ = st.integers(0, 0xFF)
times = st.integers(0, 0xFFFFFFFF)
levels = st.integers(0, 127).map(Levels)
messages = st.one_of(
    st.builds(Identity, bytes_, st.just("fingervision-board"), bytes_, st.just("1.0")),
    st.builds(Answer, bytes_, times, st.integers(0, 0xFFFF), levels, bytes_, st.sampled_from("-wlah")),
    st.builds(Refusal, bytes_, st.sampled_from(["busy", "alarm", "map"])),
    st.builds(Sample, st.integers(0, 0xFFFF), times, st.integers(0, 1023)),
    st.builds(Change, bytes_, times, levels),
)


def words_of(message: Message) -> str:
    """A message as the board's sketch writes it."""
    match message:
        case Identity(number, name, protocol, version):
            return f"I {number:02X} {name} {protocol:02X} {version}"
        case Answer(number, time_us, session, levels, changes, cause):
            return f"A {number:02X} {time_us:08X} {session:04X} {levels:02X} {changes:02X} {cause}"
        case Refusal(number, reason):
            return f"N {number:02X} {reason}"
        case Sample(number, time_us, level):
            return f"F {number:04X} {time_us:08X} {level:03X}"
        case Change(number, time_us, levels):
            return f"L {number:02X} {time_us:08X} {levels:02X}"


@given(messages)
def test_what_is_written_is_read(message: Message) -> None:
    assert decoded(encoded(words_of(message)).rstrip(b"\n")) == message


@given(messages, st.data())
def test_no_message_with_up_to_three_wrong_bits_is_read(message: Message, data: st.DataObject) -> None:
    """CRC-16/XMODEM detects up to three wrong bits: its Hamming distance is 4 for messages of up to 32751 bits."""
    line = bytearray(encoded(words_of(message)).rstrip(b"\n"))
    text = line.rindex(b"*")
    for bit in data.draw(st.lists(st.integers(0, 8 * text - 1), min_size=1, max_size=3, unique=True)):
        line[bit // 8] ^= 1 << bit % 8
    assert decoded(bytes(line)) is None


@given(st.binary(max_size=60))
def test_noise_is_no_message(noise: bytes) -> None:
    assert decoded(noise) is None


@given(st.lists(st.integers(0, 2**16 - 1), min_size=1, max_size=50), st.integers(0, 2**40))
def test_a_counter_that_wraps_is_counted_on(steps: list[int], begin: int) -> None:
    counter = Unwrapped(32)
    truth = [begin]
    for step in steps:
        truth.append(truth[-1] + step)
    counted = [counter.of(value % 2**32) for value in truth]
    assert [value - counted[0] for value in counted] == [value - begin for value in truth]
