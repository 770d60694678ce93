"""Origin of a part: this package, another distribution, a file, or the present session."""

from dataclasses import dataclass


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
