"""Origin of a part: the package itself, another distribution, a file, or this session."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a part comes from.

    Parameters
    ----------
    words : str
        As listed: `built in`, `fv-creeping-foot 1.2`, `./mine.py`, `this session`.
    remedy : str
        What a user can do to be without the part, as the end of a sentence.
    """

    words: str
    remedy: str

    @property
    def built_in(self) -> bool:
        """Whether it is part of the package."""
        return self is BUILT_IN

    def __str__(self) -> str:
        return self.words


BUILT_IN = Origin("built in", "report it")
SESSION = Origin("this session", "correct it where it is registered")


def of_distribution(name: str, version: str) -> Origin:
    """Return the origin of a part from an installed distribution."""
    return Origin(f"{name} {version}", f"ask its author, or remove it with `pip uninstall {name}`")


def of_file(path: str) -> Origin:
    """Return the origin of a part from a file that the user named."""
    return Origin(path, "correct the file, or leave it out")
