"""Write TOML: values, tables and lists of tables, so that they are read back exactly."""

import json
from collections.abc import Mapping, Sequence
from pathlib import PurePath


def toml_value(value: object) -> str:
    """Write a value; a negative number that was rounded to zero becomes 0.0 instead of -0.0."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | PurePath):
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(float(value) + 0.0)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {toml_value(each)}' for key, each in value.items())} }}"
    if isinstance(value, Sequence):
        return f"[{', '.join(map(toml_value, value))}]"
    return str(value)


def toml_lines(values: Mapping[str, object], header: str = "") -> list[str]:
    """Write a table as lines, with its header; keys without a value are left out."""
    lines = ["", header] if header else []
    return lines + [f"{key} = {toml_value(value)}" for key, value in values.items() if value is not None]
