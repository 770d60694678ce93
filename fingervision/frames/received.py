"""A frame of a live source, with the coded packets in which the camera sent it."""

from collections.abc import Iterator
from dataclasses import dataclass
from threading import Event
from typing import Protocol

import av

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description


@dataclass(frozen=True, slots=True, eq=False)
class OwnPacket:
    """A packet in the camera's own coding.

    Parameters
    ----------
    packet : av.Packet
        The packet with its bytes.
    time_s, decode_s : float
        Presentation time and decoding time, on the source's clock.
    is_key : bool
        Whether the packet's picture depends on no other picture.
    """

    packet: "av.Packet[av.VideoStream]"
    time_s: float
    decode_s: float
    is_key: bool


@dataclass(frozen=True, slots=True)
class Driven:
    """State of the stage at the exposure of a frame.

    Parameters
    ----------
    input_mm : float
        Position of the stage.
    force_n : float or None
        Force of the stage, if it is measured.
    run : str
        Name of the run to which the frame belongs; effects with memory start again with each run.
    """

    input_mm: float
    force_n: float | None = None
    run: str = "1"


@dataclass(frozen=True, slots=True, eq=False)
class Received:
    """A frame as received from a live source.

    Parameters
    ----------
    item : Frame or LostFrame
        The frame; its `time_s` is on the source's clock.
    arrived_s : float
        Time by the computer's monotonic clock at which the whole frame had been received.
    packets : tuple of OwnPacket
        Packets received since the previous frame; empty if the source does not compress.
    driven : Driven or None
        State of the stage at the exposure, if the source knows it.
    """

    item: Frame | LostFrame
    arrived_s: float
    packets: tuple[OwnPacket, ...] = ()
    driven: Driven | None = None


class LiveSource(Protocol):
    """A live source: it runs independently, and may be interrupted and opened again."""

    @property
    def description(self) -> Description:
        """Description of the source before its frames are read."""
        ...

    @property
    def has_own_clock(self) -> bool:
        """Whether times are from the source's own clock; if not, from the computer's monotonic clock on arrival."""
        ...

    @property
    def template(self) -> av.VideoStream | None:
        """The coded stream to which the packets belong; None if the source has no coded packets."""
        ...

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive; if the source is a recording, the iteration ends with the recording.

        Raises
        ------
        DeviceError
            If the connection to the source is lost.
        """
        ...

    def close(self) -> None:
        """Close the camera or connection, which ends the iteration."""
        ...


class Endable:
    """Base of sources whose frames come until they are closed."""

    template: av.VideoStream | None = None
    _closed: Event

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Yield the frames as they arrive."""
        for received in self.received():
            yield received.item

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive, until the source is closed."""
        raise NotImplementedError

    def close(self) -> None:
        """End the iteration with the next frame, or after the time limit for it."""
        self._closed.set()
