"""Kinds of gauges, one per module, each with `SPEC`, the record of its settings, and `QUANTITIES`.

A kind that measures fingers states `ASKS_FOR_FINGERS`, so that `measure` looks for them in the whole picture too.
"""

import importlib
import pkgutil
from collections.abc import Sequence
from typing import Any, Protocol

from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import GaugeStatus, Reading


class Follower(Protocol):
    """Protocol of an object that measures one gauge in the frames of one recording, in order."""

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        ...

    def lost(self) -> None:
        """Note that a frame passed in which the object was not measured, and may have moved."""
        ...


class Spec(Protocol):
    """The settings of one gauge; immutable."""

    @property
    def middle_px(self) -> tuple[float, float]:
        """Centre of the gauge in the first frame (pixels)."""
        ...

    def follower(self) -> Follower:
        """Return a new follower, for the first frame of a recording."""
        ...


class Kind(Protocol):
    """Protocol of a module that defines a kind of gauge."""

    SPEC: type[Spec]
    QUANTITIES: tuple[tuple[str, str], ...]


def kinds() -> tuple[str, ...]:
    """Names of the kinds, sorted."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def kind_named(name: str) -> Kind:
    """Return the module of a kind of gauge by its name."""
    found: Any = importlib.import_module(f"{__name__}.{name}")
    kind: Kind = found
    return kind


def measured_together(followers: Sequence[Follower], picture: Picture) -> list[Reading]:
    """Measure several gauges in one frame.

    If the followers of a kind of gauge have the method `measured_with`, all gauges of this kind are measured in one
    call.
    """
    readings: dict[int, Reading] = {}
    for number, follower in enumerate(followers):
        if number in readings:
            continue
        together = getattr(type(follower), "measured_with", None)
        if together is None:
            readings[number] = follower.measured(picture)
            continue
        alike = [i for i, other in enumerate(followers) if type(other) is type(follower)]
        readings |= dict(zip(alike, together([followers[i] for i in alike], picture), strict=True))
    return [readings[number] for number in range(len(followers))]


def unread(frame: object, status: Status, followers: Sequence[Follower]) -> list[Reading]:
    """Readings of all gauges in a frame whose picture is lost or rejected: no values, with the frame's reason.

    Parameters
    ----------
    frame : Frame or LostFrame
        The frame; a lost frame states its reason.
    status : Status
        Status of the frame.
    followers : sequence of Follower
        The gauges; their objects may have moved meanwhile.
    """
    for follower in followers:
        follower.lost()
    words = frame.words if isinstance(frame, LostFrame) else ""
    return [Reading(GaugeStatus(status.value), words=words)] * len(followers)
