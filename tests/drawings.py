"""A drawing of a mechanism as a file, as a user gives it to a model."""

from pathlib import Path

from fingervision.models.mechanism import Mechanism
from fingervision.storage.mechanism_toml import read_mechanism


def drawing(folder: Path, text: str, name: str = "mechanism") -> Mechanism:
    """Write a text to NAME.toml, and read it."""
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return read_mechanism(folder / f"{name}.toml")
