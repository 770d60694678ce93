"""Recognise the purpose of a TOML file of this program by its tables, for the message on a file for another option."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.errors import DataError

# Table or key that only this kind of file has, whether it is a list of tables, and the option that takes the file.
_PURPOSES = {
    "the description of a bed": (("actuator", dict), "the option --bed takes it"),
    "a gauge file": (("gauge", list), "the option --gauges of measure and live takes it"),
    "the drawing of a mechanism": (("body", list), "the options --mechanism of measure and --model take it"),
    "the drawing of a gripper": (("lever", dict), "the options --mechanism of measure and --model take it"),
    "a mechanism after a gripper": (("gripper", dict), "the options --mechanism of measure and --model take it"),
    "a recipe": (("step", list), "the command bed run takes it"),
    "a corrected model": (("base", str), "the option --model of compare and diagnose takes it"),
}
DRAWINGS = ("the drawing of a mechanism", "the drawing of a gripper", "a mechanism after a gripper")


def refuse_other_file(path: Path | str, tables: Mapping[str, Any], need: str, wanted: Collection[str]) -> None:
    """Refuse a TOML file of another purpose; the message names the option or command that takes the file.

    Parameters
    ----------
    path : Path or str
        The file, for the message.
    tables : mapping
        Its tables.
    need : str
        What the file must be, for the message.
    wanted : collection of str
        Accepted kinds of file, in the words of this module.

    Raises
    ------
    DataError
        The tables belong to another kind of file.
    """
    for what, ((key, kind), takes) in _PURPOSES.items():
        if isinstance(tables.get(key), kind):
            if what not in wanted:
                raise DataError(f"{path} must be {need}, but is {what}: {takes}.")
            return
