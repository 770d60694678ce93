"""Entries of a registry: a part with its origin, or an unusable plug-in with the reason."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from fingervision.plugins.origin import Origin

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Entry(Generic[T]):
    """A part with its name and its origin."""

    name: str
    value: T
    origin: Origin


@dataclass(frozen=True, slots=True)
class Refusal:
    """A plug-in that cannot be used, with the reason.

    Parameters
    ----------
    name : str
        Name under which the distribution registers the plug-in.
    origin : Origin
        Origin of the plug-in.
    sentence : str
        Sentence that states the reason and what to do.
    """

    name: str
    origin: Origin
    sentence: str
