"""Files that are damaged, made up or meant to do harm: a sentence, nothing executed, nothing lost."""

import random
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fingervision.domain import needed_library
from fingervision.domain.errors import DataError, FingervisionError, MissingLibraryError
from fingervision.tables import text_file
from fingervision.tables.formats import read_raw, xlsx
from fingervision.tables.formats._apart import read_apart
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.read import read_drive, read_measured_table, read_model
from tests.storage.foreign import binary

GB = 1_000_000_000


def rewritten(path: Path, **parts: bytes) -> Path:
    """Exchange parts of a workbook's archive, or add some."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    content |= {name.replace("__", "/").replace("_dot_", "."): part for name, part in parts.items()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, part in content.items():
            archive.writestr(name, part)
    return path


def refused(path: Path) -> str:
    with pytest.raises(DataError) as caught:
        read_measured_table(path)
    return str(caught.value)


def test_a_line_of_two_gigabytes_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    with path.open("wb") as file:
        file.write(b"1.5,2.5," * 1_000_000)
        file.truncate(2 * GB)  # sparse: it takes no room
    assert "a line of more than 1000000 characters" in refused(path)


def test_a_long_line_below_a_good_header_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    path.write_text("time [s],position [mm],gap [mm]\n0,1,2\n" + "1," * text_file.LONGEST_LINE)
    assert "a line of more than 1000000 characters" in refused(path)


def test_a_table_of_a_hundred_thousand_columns_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "wide.csv"
    path.write_text(",".join(f"c{k}" for k in range(100_000)) + "\n" + ",".join("1" * 100_000) + "\n")
    with pytest.raises(FingervisionError, match="at most 4096 columns, but has 100000"):
        read_raw(path, Entry())


def test_a_text_of_more_than_a_gigabyte_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.write(b"time [s],position [mm],gap [mm]\n0,1,2\n")
        file.truncate(2 * GB)
    assert "at most 1 GB" in refused(path)


def test_a_workbook_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = rewritten(binary.excel_plain(tmp_path), xl__worksheets__sheet9_dot_xml=b"0" * 3_000_000)
    assert path.stat().st_size < 30_000
    monkeypatch.setattr(xlsx, "MOST_UNPACKED_BYTES", 2_000_000)
    assert "would unpack to 3 MB" in refused(path)


def test_xml_entities_are_not_expanded(tmp_path: Path) -> None:
    bomb = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbbbbbbbb"><!ENTITY c "&b;&b;&b;&b;">]><a>&c;</a>'
    assert "defines XML entities" in refused(rewritten(binary.excel_plain(tmp_path), xl__sharedStrings_dot_xml=bomb))


def test_macros_are_not_looked_at(tmp_path: Path) -> None:
    path = rewritten(binary.excel_plain(tmp_path), xl__vbaProject_dot_bin=b"\xd0\xcf\x11\xe0 Sub Auto_Open()")
    table = read_measured_table(path.rename(tmp_path / "macros.xlsm"))
    np.testing.assert_allclose(table.gap_mm, binary.GAP_MM, atol=1e-9)
    assert any("without its macros" in note for note in table.notes)


def test_a_formula_that_was_never_calculated_is_told_by_its_cell(tmp_path: Path) -> None:
    rows = binary.rows_of(binary.TIME_S, binary.INPUT_MM, binary.GAP_MM)
    rows[4][2] = "=4+7.7*B6"
    path = binary.workbook(tmp_path / "f.xlsx", [["time (s)", "position (mm)", "gap (mm)"]], rows)
    assert "row 6, column 3" in (words := refused(path))
    assert "formula" in words
    # As Excel saves it: with the value beside the formula.
    with zipfile.ZipFile(path) as archive:
        sheet = archive.read("xl/worksheets/sheet1.xml").decode()
    value = f"<f>4+7.7*B6</f><v>{binary.GAP_MM[4]}</v>".encode()
    sheet_bytes = sheet.encode().replace(b"<f>4+7.7*B6</f><v></v>", value).replace(b"<f>4+7.7*B6</f><v />", value)
    assert value in sheet_bytes
    table = read_measured_table(rewritten(path, xl__worksheets__sheet1_dot_xml=sheet_bytes))
    np.testing.assert_allclose(table.gap_mm, binary.GAP_MM, atol=1e-9)


def test_merged_cells_among_the_rows_are_refused(tmp_path: Path) -> None:
    import openpyxl

    path = binary.excel_plain(tmp_path)
    book = openpyxl.load_workbook(path)
    book.active.merge_cells("B5:B8")
    book.save(path)
    assert "rows 5 to 8, columns 2 to 2 are merged" in refused(path)


def test_links_out_of_a_matlab_file_are_not_followed(tmp_path: Path) -> None:
    import h5py

    secret = binary.matlab_73(tmp_path)
    with h5py.File(tmp_path / "links.mat", "w") as file:
        for name in ("time_s", "position_um", "gap_mm"):
            file[name] = h5py.ExternalLink(secret.name, name)
    assert "a link" in refused(tmp_path / "links.mat")
    layout = h5py.VirtualLayout(shape=(1, binary.ROWS), dtype="f8")
    layout[:] = h5py.VirtualSource(secret, "gap_mm", shape=(1, binary.ROWS))
    with h5py.File(tmp_path / "virtual.mat", "w") as file:
        file.create_virtual_dataset("gap_mm", layout)
    assert "outside of the file" in refused(tmp_path / "virtual.mat")


def test_cells_and_objects_of_matlab_are_told_and_passed_over(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(
        tmp_path / "cells.mat", {"run": np.array([np.arange(3.0), "eval('!rm')"], dtype=object), "z": 1j * np.ones(9)}
    )
    words = refused(tmp_path / "cells.mat")
    assert "run (cell)" in words
    assert "vectors" in words


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\x00" * 5000, "is blank"),
        (b"\n\n  \n", "is blank"),
        (b"\xd0\xcf\x11\xe0" * 100, "old Excel"),
        (b"\x1f\x8b" + b"x" * 100, "gzip"),
        (b"PK\x03\x04" + b"x" * 100, "archive"),
        (b"%PDF-1.7 1 2 3", "PDF"),
        (b"\x00\x01\x02" * 3000, "zero bytes"),
        (b"time [s],gap [mm]\n" + b"a,b\n" * 9, "rows of two numbers"),
        (bytes(range(1, 256)) * 40, "must"),
    ],
)
def test_what_is_no_table_is_a_sentence(content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / "table.dat").write_bytes(content)
    assert words in refused(tmp_path / "table.dat")


@pytest.mark.parametrize(
    "make",
    [
        binary.excel_plain,
        binary.tdms_channels,
        *(
            pytest.param(make, marks=pytest.mark.slow)
            for make in (binary.matlab_73, binary.matlab_struct, binary.matlab_4, binary.parquet_units_in_names)
        ),
    ],
)
def test_damaged_bytes_end_in_a_sentence_or_in_a_table(make, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    content = make(tmp_path).read_bytes()
    suffix = next(tmp_path.iterdir()).suffix
    rng = random.Random(11)
    for number in range(6):
        broken = bytearray(content if number % 2 else content[: rng.randrange(20, len(content))])
        for _ in range(rng.randrange(1, 12)):
            broken[rng.randrange(8, len(broken))] = rng.randrange(256)
        path = tmp_path / f"broken{number}{suffix}"
        path.write_bytes(bytes(broken))
        said = str(path)
        try:
            read_measured_table(path)
        except FingervisionError as error:
            said = str(error)
        assert str(path) in said


def test_a_missing_library_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    path = binary.tdms_channels(tmp_path)
    monkeypatch.setattr(needed_library, "importlib", SimpleNamespace(import_module=missing))
    with pytest.raises(MissingLibraryError, match=r"fingervision\[formats\]"):
        read_drive(path)


def test_a_reader_that_crashes_is_a_sentence(tmp_path: Path) -> None:
    module = tmp_path / "crashing_reader.py"
    module.write_text("import os, signal\ndef read(path, given):\n    os.kill(os.getpid(), signal.SIGSEGV)\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        with pytest.raises(DataError, match=r"crashed \(signal 11"):
            read_apart("crashing_reader", tmp_path / "table.mat", Entry())


def test_prose_given_as_a_model_is_said_to_be_none(tmp_path: Path) -> None:
    prose = tmp_path / "README.md"
    lines = [f"* part {k}, " + "which has, " * (k % 4) + "a hinge" for k in range(12)]
    prose.write_text("# A gripper\n\n" + "\n".join(lines), encoding="utf-8")
    with pytest.raises(DataError, match="is not a model") as caught:
        read_model(prose)
    assert "simulation table" in str(caught.value)
    assert "FMU" in str(caught.value)
    assert ". " not in str(caught.value).removeprefix(str(tmp_path))


def test_a_table_of_lengths_is_no_drive_and_none_of_its_columns_is_suggested_as_the_time(tmp_path: Path) -> None:
    path = tmp_path / "simulation.csv"
    path.write_text("input_mm,gap_mm\n-0.5,0.1394\n1.6,16.353920\n", encoding="utf-8")
    with pytest.raises(DataError, match="must have a column time_s") as caught:
        read_drive(path)
    assert "columns.time" not in str(caught.value)


def test_a_text_with_a_table_in_it_is_no_table(tmp_path: Path) -> None:
    """A README has some lines with numbers; a separator would not help, another file does."""
    words = "\n".join(f"It was measured {k} times{', and once more' * (k % 4)}; {k} of them hold." for k in range(30))
    path = tmp_path / "README.md"
    path.write_text(f"# Title\n\n| what | mm |\n|---|---|\n| one | 3 |\n| two | 4 |\n\n{words}\n")
    for read in (read_measured_table, read_drive, read_model):
        with pytest.raises(DataError, match=r"not a table|not a model"):
            read(path)


def test_a_json_document_is_called_by_its_name(tmp_path: Path) -> None:
    for number, document in enumerate(
        ('{"time": [0, 1], "gap": [1, 2]}', '[{"time_s": 0.1,\n"gap_mm": 2}]', "[[0, 1], [1, 2]]")
    ):
        path = tmp_path / f"{number}.json"
        path.write_text(document, encoding="utf-8")
        assert "JSON" in refused(path)


def test_a_matrix_with_a_row_for_each_channel_is_read_and_a_picture_is_named(tmp_path: Path) -> None:
    from scipy.io import savemat

    time_s = 0.01 * np.arange(713)
    savemat(tmp_path / "wide.mat", {"data": np.vstack([time_s, np.sin(time_s)])})
    raw = read_raw(tmp_path / "wide.mat", Entry())
    assert raw.rows == 713
    assert len(raw.columns) == 2
    savemat(tmp_path / "picture.mat", {"picture": np.zeros((300, 400))})
    assert "picture (300 x 400)" in refused(tmp_path / "picture.mat")


def test_what_a_reader_raises_becomes_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RecursionError("too deep")

    monkeypatch.setattr("fingervision.tables.formats.text.table_of_lines", fail)
    path = tmp_path / "table.csv"
    path.write_text("time [s],position [mm],gap [mm]\n0,1,2\n", encoding="utf-8")
    assert "RecursionError: too deep" in refused(path)


def test_to_leave_cells_out_is_offered_only_if_most_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "words.csv"
    rows = [f"{0.1 * k:.1f};{k};{'ERR' if k % 9 else k}" for k in range(1, 121)]
    path.write_text("\n".join(["Time [s];Position [mm];Gap [mm]", *rows]), encoding="utf-8")
    with pytest.raises(OpenQuestionError) as caught:
        read_measured_table(path)
    assert "unreadable_cells" not in str(caught.value)
