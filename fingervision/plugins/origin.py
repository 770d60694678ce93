"""Entries of a registry: a part or an unusable plug-in, with its origin."""

from dataclasses import dataclass
from typing import Generic, TypeVar


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of a part.

    Parameters
    ----------
    words : str
        Origin as listed: `built in`, `fv-creeping-foot 1.2`, `./mine.py`, `this session`.
    remedy : str
        Action by which a user can remove the part, as the end of a sentence.
    """

    words: str
    remedy: str

    @property
    def built_in(self) -> bool:
        """Whether the part is built into fingervision."""
        return self is BUILT_IN

    def __str__(self) -> str:
        return self.words


BUILT_IN = Origin("built in", "report it")
SESSION = Origin("this session", "correct it where it is registered")


def of_distribution(name: str, version: str) -> Origin:
    """Return the origin of a part that an installed distribution provides."""
    return Origin(f"{name} {version}", f"ask its author, or remove it with `pip uninstall {name}`")


def of_file(path: str) -> Origin:
    """Return the origin of a part that is defined in a file named by the user."""
    return Origin(path, "correct the file, or leave it out")


# Entries of a registry: a part with its origin, or an unusable plug-in with the reason.

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
