"""Names of result folders: the file name of the input, with as much of its path as makes the name unique."""

import hashlib
from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path

BETWEEN = "__"
LONGEST = 200
"""Largest length of a name in characters; file systems allow 255 bytes, and the temporary name of a folder is
longer."""


def folder_names(inputs: Sequence[Path], taken: Collection[str]) -> tuple[str, ...]:
    """Choose a folder name for each input; names are unique even without distinction of upper and lower case.

    Parameters
    ----------
    inputs : sequence of Path
        Absolute paths of the inputs, all different.
    taken : collection of str
        Names that are already in use.
    """
    parts = [path.parts[1:] or path.parts for path in inputs]
    depth = [1] * len(inputs)
    reserved = {name.casefold() for name in taken}
    while True:
        names = [BETWEEN.join(part[-deep:]) for part, deep in zip(parts, depth, strict=True)]
        count = Counter(name.casefold() for name in names)
        clashing = [
            number for number, name in enumerate(names) if count[name.casefold()] > 1 or name.casefold() in reserved
        ]
        longer = [number for number in clashing if depth[number] < len(parts[number])]
        if not longer:
            break
        for number in longer:
            depth[number] += 1
    # Part of a hash is added if the path does not make a name unique (a name may contain the separator) or is too long.
    for number, name in enumerate(names):
        if number in set(clashing) or len(name) > LONGEST:
            code = hashlib.sha256(str(inputs[number]).encode("utf-8", "surrogateescape")).hexdigest()[:12]
            names[number] = f"{name[-LONGEST:]}{BETWEEN}{code}"
    return tuple(names)
