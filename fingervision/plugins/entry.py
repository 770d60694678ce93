"""An entry of a registry: a part with its origin, or a plug-in that was left out with the reason."""

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
    """A plug-in that was left out.

    Parameters
    ----------
    name : str
        As its distribution registers it.
    origin : Origin
        Where it comes from.
    sentence : str
        Why, and what to do.
    """

    name: str
    origin: Origin
    sentence: str
