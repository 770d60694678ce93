"""MATLAB files: versions 4 to 7 with scipy, version 7.3 (HDF5) with h5py; only numbers, no objects and no code."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.needed_library import needed_library
from fingervision.tables.mapping import Entry
from fingervision.tables.parts import WIDEST, chosen_part, is_numeric, tables_of
from fingervision.tables.raw_table import RawTable

ORDER = 30
IN_OWN_PROCESS = True
HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_AT = (0, 512)
MOST_BYTES = 2_000_000_000
MOST_VALUES = 50_000_000
"""Largest number of values in one variable; usual tables have up to a million rows."""
DEEPEST = 4
NOT_NUMBERS = frozenset({b"cell", b"function_handle", b"char", b"table", b"timetable", b"timeseries", b"string"})


def recognises(path: Path, head: bytes) -> bool:
    """Whether the first bytes of a file are those of a MATLAB file; the oldest version is recognised by its suffix."""
    return head.startswith(b"MATLAB ") or _is_hdf5(head) or path.suffix.lower() == ".mat"


def _is_hdf5(head: bytes) -> bool:
    return any(head[at : at + len(HDF5)] == HDF5 for at in HDF5_AT)


def read(path: Path, given: Entry) -> RawTable:
    """Read vectors of equal length, a matrix, or a structure of vectors as a table."""
    with path.open("rb") as file:
        head = file.read(1024)
    if path.stat().st_size > MOST_BYTES:
        raise DataError(
            f"{path} must have at most {MOST_BYTES / 1e9:g} GB, but has {path.stat().st_size / 1e9:.1f} GB: save only "
            "the variables of the table."
        )
    passed: list[str] = []
    values = _hdf5(path, passed) if _is_hdf5(head) else _older(path, passed)
    tables = tables_of(values)
    note = (f"Not read, because they are not arrays of real numbers: {', '.join(sorted(passed))}.",) if passed else ()
    if not tables:
        shapes = [f"{name} ({' x '.join(map(str, each.shape))})" for name, each in values.items() if is_numeric(each)]
        held = f"only {', '.join([*shapes, *sorted(passed)])}" if shapes or passed else "none"
        raise DataError(
            f"{path} must hold vectors of equal length or a matrix of at most {WIDEST} columns, but holds {held} "
            "(tables, timetables, cells and objects of MATLAB are not arrays): save vectors, save('run.mat', 'time', "
            "'position', 'gap')."
        )
    part = chosen_part(path, {name: [c.name for c in columns] for name, columns in tables.items()}, given, "variable")
    columns = tables[part]
    named = not all(column.name.isdecimal() for column in columns)
    return RawTable(
        path,
        f"MATLAB file{' 7.3' if _is_hdf5(head) else ''}, {part}",
        tuple(columns),
        notes=(*note, *(() if named else (f"Columns of the matrix {part} are named by their numbers.",))),
        settings={"part": part},
        named=named,
    )


def _older(path: Path, passed: list[str]) -> dict[str, Any]:
    """Read versions 4 to 7 with scipy, which builds numbers, texts and structures and executes no code."""
    from scipy.io import loadmat, whosmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        listed = whosmat(str(path))
        wanted = []
        for name, shape, kind in listed:
            size = int(np.prod([max(0, int(n)) for n in shape], dtype=np.float64)) if shape else 0
            _check_size(path, name, size)
            if kind in ("cell", "function", "opaque", "object", "char", "sparse", "unknown"):
                passed.append(f"{name} ({kind})")
            else:
                wanted.append(name)
        # The sizes stated in a damaged or malicious file may be wrong: every variable is checked before it is read.
        content = loadmat(str(path), variable_names=wanted, simplify_cells=True) if wanted else {}
    return {name: _plain(content[name], name, passed) for name in wanted if name in content}


def _plain(value: Any, name: str, passed: list[str], deep: int = 0) -> Any:
    """Return arrays of real numbers and structures of such arrays; other values become None and are listed."""
    if isinstance(value, dict) and deep < DEEPEST:
        return {key: _plain(item, f"{name}.{key}", passed, deep + 1) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        return value
    if isinstance(value, int | float | np.number):
        return None  # a scalar (such as a rate or a date) is not a column
    passed.append(f"{name} ({'complex numbers' if np.iscomplexobj(value) else type(value).__name__})")
    return None


def _hdf5(path: Path, passed: list[str]) -> dict[str, Any]:
    """Read version 7.3: data sets in the file itself; links to other files are not followed."""
    library = needed_library("h5py", "formats", f"{path} is a MATLAB 7.3 file (HDF5), which", "save the table as CSV")
    with library.File(path, "r") as file:
        return _group(library, file, "", passed, 0)


def _group(library: Any, group: Any, prefix: str, passed: list[str], deep: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in group:
        if name.startswith("#"):  # group in which MATLAB stores the content of cell arrays
            continue
        full = f"{prefix}{name}"
        link = group.get(name, getlink=True)
        if not isinstance(link, library.HardLink):
            passed.append(f"{full} (a link)")
            continue
        item = group[name]
        kind = item.attrs.get("MATLAB_class", b"double")
        if isinstance(item, library.Group):
            if deep < DEEPEST and kind not in NOT_NUMBERS:
                found[name] = _group(library, item, f"{full}.", passed, deep + 1)
            continue
        if not isinstance(item, library.Dataset) or item.is_virtual or item.external:
            passed.append(f"{full} (data outside of the file)")
        elif kind in NOT_NUMBERS or item.dtype.kind not in "fiub" or "MATLAB_empty" in item.attrs:
            passed.append(f"{full} ({kind.decode(errors='replace') if isinstance(kind, bytes) else kind})")
        else:
            _check_size(group.file.filename, full, item.size)
            # MATLAB stores arrays column by column, but h5py reads them row by row.
            value = np.asarray(item[()]).T
            if is_numeric(value):
                found[name] = value
    return found


def _check_size(path: Path | str, name: str, size: int) -> None:
    """Refuse a variable that is too large, before its values are read."""
    if size > MOST_VALUES:
        raise DataError(
            f"Variables of {path} must have at most {MOST_VALUES} values, but {name} has {size}: leave it out."
        )
