"""Every declared record of a file format: in the reference page, and the same after it was written and read."""

import csv
import dataclasses
import importlib
import pkgutil
from enum import Enum
from pathlib import Path
from typing import Any

import pytest

from fingervision import storage
from fingervision.domain.field import Declared, declared, reference_table
from fingervision.storage.row_file import RowFile, row_of

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "file_formats.md").read_text(encoding="utf-8")
MODULES = [
    importlib.import_module(f"{storage.__name__}.{each.name}") for each in pkgutil.iter_modules(storage.__path__)
]
RECORDS = [
    found
    for module in MODULES
    for found in vars(module).values()
    if dataclasses.is_dataclass(found)
    and found.__module__ == module.__name__
    and any(each.field.meaning for each in declared(found))
]
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
