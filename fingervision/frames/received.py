"""A frame of a live source, with the coded packets in which the camera sent it."""

from collections.abc import Iterator
from dataclasses import dataclass
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
        The bytes.
    time_s, decode_s : float
        When it is shown and when it is decoded, on the source's clock.
    is_key : bool
        Whether its picture hangs on no other.
    """

    packet: "av.Packet[av.VideoStream]"
    time_s: float
    decode_s: float
    is_key: bool


@dataclass(frozen=True, slots=True)
class Driven:
    """State of the stage at a frame's exposure.

    Parameters
    ----------
    input_mm : float
        Where it stood.
    force_n : float or None
        How hard it pushed, where that is measured.
    run : str
        Run that the frame belongs to; what has a memory begins anew with each.
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
        `time_s` is on the source's clock.
    arrived_s : float
        When the host had all of it, on the host's monotonic clock.
    packets : tuple of OwnPacket
        What came in since the frame before; empty where the source codes nothing.
    driven : Driven or None
        What moved the gripper when the frame was exposed, where the source knows it.
    """

    item: Frame | LostFrame
    arrived_s: float
    packets: tuple[OwnPacket, ...] = ()
    driven: Driven | None = None


class LiveSource(Protocol):
    """A source that runs by itself, and may be interrupted and opened again."""

    @property
    def description(self) -> Description:
        """What is known of the source before its frames are read."""
        ...

    @property
    def has_own_clock(self) -> bool:
        """Whether times are those of the source; otherwise they are the computer's monotonic clock on arrival."""
        ...

    @property
    def template(self) -> av.VideoStream | None:
        """The coded stream to which the packets belong; None where there is none."""
        ...

    def received(self) -> Iterator[Received]:
        """Yield the frames as they arrive; ends where a recording ends.

        Raises
        ------
        DeviceError
            The source is cut off.
        """
        ...

    def close(self) -> None:
        """Close the camera or connection, which ends the iteration."""
        ...
