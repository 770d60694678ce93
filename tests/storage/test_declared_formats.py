"""Every declared record of a file format: in the reference page, and the same after it was written and read."""

import csv
import dataclasses
import importlib
import math
import pkgutil
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
import pytest

from fingervision import storage
from fingervision.domain import gripper
from fingervision.domain.errors import DataError
from fingervision.domain.field import Declared, Field, declared, reference_table
from fingervision.gauges.kinds import kind_named, kinds
from fingervision.storage.row_file import RowFile, row_of
from fingervision.storage.toml_section import Section

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "file_formats.md").read_text(encoding="utf-8")
MODULES = [
    gripper,
    *(importlib.import_module(f"{storage.__name__}.{each.name}") for each in pkgutil.iter_modules(storage.__path__)),
]
RECORDS = [
    found
    for module in MODULES
    for found in vars(module).values()
    if dataclasses.is_dataclass(found)
    and found.__module__ == module.__name__
    and any(each.field.meaning for each in declared(found))
]
TABLES = [record for record in RECORDS if not record.__module__.endswith("_csv")]
ROWS = [record for record in RECORDS if record.__module__.endswith("_csv")]
OF_KIND: dict[Any, Any] = {float: 0.25, int: 3, str: 'a,"b"', bool: True}


def value_of(each: Declared) -> Any:
    return next(iter(each.kind)) if issubclass(each.kind, Enum) else OF_KIND[each.kind]


def name_of(record: Any) -> str:
    return str(record.__name__)


@pytest.mark.parametrize("record", RECORDS, ids=name_of)
def test_the_reference_page_states_the_fields_as_they_are_declared(record: Any) -> None:
    assert all(each.field.meaning for each in declared(record))
    table = reference_table(record)
    assert table in PAGE, f"docs/reference/file_formats.md must hold this table of {record.__name__}:\n{table}"


def test_the_reference_page_states_the_settings_of_every_kind_of_gauge() -> None:
    assert reference_table(*(kind_named(name).SPEC for name in kinds())) in PAGE


@pytest.mark.parametrize("record", ROWS, ids=name_of)
def test_a_row_is_the_same_after_it_was_written_and_read(record: Any, tmp_path: Path) -> None:
    full = record(**{each.name: value_of(each) for each in declared(record)})
    bare = dataclasses.replace(full, **{each.name: None for each in declared(record) if each.is_optional})
    with RowFile(tmp_path / "table.csv", record) as table:
        table.add([full, bare])
    header, *lines = csv.reader((tmp_path / "table.csv").read_text(encoding="utf-8").splitlines())
    assert header == [each.name for each in declared(record)]
    assert [row_of(record, header, cells) for cells in lines] == [full, bare]


@pytest.mark.parametrize("record", ROWS, ids=name_of)
def test_a_cell_that_is_no_value_of_its_field_is_refused(record: Any) -> None:
    for each in declared(record):
        if each.kind is not str:
            with pytest.raises(ValueError, match="odd"):
                row_of(record, [each.name], ["odd"])
    if any(each.is_required and not each.is_optional and each.kind is not str for each in declared(record)):
        with pytest.raises(TypeError):
            row_of(record, [], [])


def inside(field: Field) -> float:
    middle = 0.5 * (field.low + field.high)
    return next(value for value in (1.0, 0.25, 100.0, middle) if field.refusal(value) is None)


def outside(field: Field) -> list[float]:
    beyond = [field.low - 1.0, 2.0 * field.high + 1.0, field.above, field.below]
    return [value for value in beyond if math.isfinite(value)]


def document(record: Any) -> dict[str, Any]:
    """A document with a value for each field of a record, as it is parsed from a file."""
    return {each.name: in_document(each.kind, each.field) for each in declared(record)}


def in_document(kind: Any, field: Field) -> Any:
    if dataclasses.is_dataclass(kind):
        return document(kind)
    if field.shape:
        return np.ones([3 if size < 0 else size for size in field.shape]).tolist()
    if get_origin(kind) is tuple:
        inner = get_args(kind)
        return [in_document(one, field) for one in (inner[:1] * 3 if Ellipsis in inner else inner)]
    if kind is str:
        return field.of[0] if field.of else "a word"
    if issubclass(kind, Enum):
        return next(iter(kind)).value
    return kind(inside(field))


def refused(record: Any, values: dict[str, Any]) -> str:
    with pytest.raises(DataError) as caught:
        Section(Path("file.toml"), "", "", values).record(record)
    assert "file.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("record", TABLES, ids=name_of)
def test_a_table_is_read_and_each_key_is_needed_or_not_as_declared(record: Any) -> None:
    whole = document(record)
    for each in declared(record):
        rest = {name: value for name, value in whole.items() if name != each.name}
        if each.is_required:
            assert each.name in refused(record, rest)
        else:
            assert isinstance(Section(Path("file.toml"), "", "", rest).record(record), record)


@pytest.mark.parametrize("record", TABLES, ids=name_of)
def test_a_key_that_is_not_declared_is_refused_with_the_nearest(record: Any) -> None:
    for name in document(record):
        words = refused(record, {**document(record), f"{name}s": 1.0})
        assert f"{name}s" in words
        assert f"did you mean {name}?" in words


@pytest.mark.parametrize("record", TABLES, ids=name_of)
def test_a_value_beyond_each_declared_limit_is_refused_with_limit_and_value(record: Any) -> None:
    for each in declared(record):
        if any(map(dataclasses.is_dataclass, (each.kind, *get_args(each.kind)))):
            continue
        wrong = [math.nan, math.inf, 10**400, True, {"value": 1.0}, *outside(each.field)]
        if each.kind in (str, bool):
            wrong = [1.0, {"value": 1.0}, *(["no such word"] if each.field.of else [])]
        for value in wrong:
            given = in_document(each.kind, each.field)
            points = isinstance(given, list) and isinstance(given[0], list)
            first = [value, *given[0][1:]] if points else value
            bad = [first, *given[1:]] if isinstance(given, list) and not each.field.shape else value
            words = refused(record, {**document(record), each.name: bad})
            assert each.name in words
            assert (f"{value:g}" if isinstance(value, float) else repr(value)) in words
