"""Foreign tables in binary formats, made when the tests run; each with its truth as arrays."""

import datetime as dt
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROWS = 24
TIME_S = np.arange(ROWS) / 10.0
INPUT_MM = np.round(0.8 * np.sin(0.9 * TIME_S) + 0.61, 4)
GAP_MM = np.round(4.0 + 7.7 * INPUT_MM, 4)
TRUTH = {"time_s": TIME_S, "input_mm": INPUT_MM, "gap_mm": GAP_MM}


def workbook(path: Path, header: list[list[Any]], rows: list[list[Any]], title: str = "Messung", **more: Any) -> Path:
    """Write a sheet; `more` are further sheets, rows each."""
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = title
    for row in [*header, *rows]:
        book.active.append(row)
    for name, other in more.items():
        sheet = book.create_sheet(name)
        for row in other:
            sheet.append(row)
    book.save(path)
    return path


def rows_of(*columns: Any) -> list[list[Any]]:
    """Put columns side by side."""
    return [[each.item() if hasattr(each, "item") else each for each in row] for row in zip(*columns, strict=True)]


def excel_plain(folder: Path) -> Path:
    return workbook(
        folder / "plain.xlsx",
        [["Zeit [ms]", "Weg [µm]", "Abstand [mm]"]],
        rows_of(TIME_S * 1e3, INPUT_MM * 1e3, GAP_MM),
    )


def excel_title_and_units_row(folder: Path) -> Path:
    top = [["Versuch 3, Greifer", None, None], [None, None, None], ["Time", "Position", "Gap"], ["s", "um", "mm"]]
    return workbook(folder / "units.xlsx", top, rows_of(TIME_S, INPUT_MM * 1e3, GAP_MM))


def excel_offset_columns(folder: Path) -> Path:
    return workbook(folder / "offset.xlsx", [[], [None, "time (s)", "position (mm)", "gap (mm)"]],
                    [[None, *row] for row in rows_of(TIME_S, INPUT_MM, GAP_MM)])  # fmt: skip


def excel_dates(folder: Path) -> Path:
    start = dt.datetime(2024, 5, 3, 23, 59, 59)
    stamps = [start + dt.timedelta(seconds=float(s)) for s in TIME_S]
    return workbook(folder / "dates.xlsx", [["Zeit", "Position (mm)", "Gap (mm)"]], rows_of(stamps, INPUT_MM, GAP_MM))


def excel_notes_beside(folder: Path) -> Path:
    return workbook(folder / "notes.xlsx", [["time (s)", "position (mm)", "gap (mm)"]], rows_of(TIME_S, INPUT_MM, GAP_MM),
                    Notes=[["operator", "kh"], ["bench", 3]])  # fmt: skip


def excel_merged_title(folder: Path) -> Path:
    import openpyxl

    path = workbook(
        folder / "title.xlsx",
        [["Versuch", None, None], ["time (s)", "position (mm)", "gap (mm)"]],
        rows_of(TIME_S, INPUT_MM, GAP_MM),
    )
    book = openpyxl.load_workbook(path)
    book.active.merge_cells("A1:C1")
    book.save(path)
    return path


def excel_numbers_as_text(folder: Path) -> Path:
    """Values that were pasted as text, with decimal commas."""
    rows = [[str(cell).replace(".", ",") for cell in row] for row in rows_of(TIME_S, INPUT_MM, GAP_MM)]
    return workbook(folder / "text.xlsx", [["Zeit (s)", "Weg (mm)", "Abstand (mm)"]], rows)


def excel_midnight_and_statistics(folder: Path) -> Path:
    start = dt.datetime(2024, 5, 3, 23, 59, 59)
    clock = [(start + dt.timedelta(seconds=float(s))).time() for s in TIME_S]
    rows = [*rows_of(clock, INPUT_MM, GAP_MM), [], ["Mean", 0.7, 7.9], ["Std. dev.", 0.1, 0.9]]
    return workbook(folder / "clock.xlsx", [["Time", "Position (mm)", "Gap (mm)"]], rows)


def modelica_result(folder: Path) -> Path:
    """Lay data out as Dymola and OpenModelica do: names and descriptions by columns, values by rows."""
    from scipy.io import savemat

    def characters(words: list[str]) -> np.ndarray:
        return np.array([list(word.ljust(max(map(len, words)))) for word in words])

    content = {
        "Aclass": characters(["Atrajectory", "1.1", "", "binTrans"]),
        "name": np.ascontiguousarray(characters(["time", "stiffness", "stage.position", "finger.gap"]).T),
        "description": np.ascontiguousarray(characters(["Time in [s]", "[N/m]", "Drive [m|mm]", "Opening [m|mm]"]).T),
        "dataInfo": np.array([[0, 1, 0, -1], [1, 2, 0, 0], [2, 2, 0, -1], [2, -3, 0, -1]], dtype=np.int32).T,
        "data_1": np.array([[0.0, 2.3], [1e4, 1e4]]),
        "data_2": np.stack([TIME_S, INPUT_MM * 1e-3, -GAP_MM * 1e-3]),
    }
    savemat(folder / "modelica.mat", content, format="4")
    return folder / "modelica.mat"


def matlab_struct(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(
        folder / "struct.mat",
        {"run": {"time_ms": TIME_S * 1e3, "position_um": INPUT_MM * 1e3, "gap_mm": GAP_MM}, "rate": 10.0},
    )
    return folder / "struct.mat"


def matlab_vectors_beside_others(folder: Path) -> Path:
    from scipy.io import savemat

    others = {"picture": np.zeros((4, 300)), "cells": np.array([1, "a"], dtype=object), "name": "bench 3"}
    savemat(folder / "vectors.mat", {"time_s": TIME_S, "input_mm": INPUT_MM[:, None], "gap_mm": GAP_MM, **others})
    return folder / "vectors.mat"


def matlab_4(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "four.mat", {"time_s": TIME_S, "input_mm": INPUT_MM, "gap_mm": GAP_MM}, format="4")
    return folder / "four.mat"


def matlab_73(folder: Path) -> Path:
    """Lay data out as MATLAB's -v7.3 does: a user block of 512 bytes, columns as rows, classes as attributes."""
    import h5py

    path = folder / "seven.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time_s", TIME_S), ("position_um", INPUT_MM * 1e3), ("gap_mm", GAP_MM)):
            data = file.create_dataset(name, data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
        refs = file.create_group("#refs#")
        refs.create_dataset("a", data=np.zeros((1, 5)))
        word = file.create_dataset("operator", data=np.frombuffer("kh".encode("utf-16-le"), dtype=np.uint16)[None, :])
        word.attrs["MATLAB_class"] = np.bytes_("char")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri May  3 10:11:12 2024 HDF5 schema 1.00 ."
    with path.open("rb+") as file:
        file.write(head.ljust(124) + b"\x00\x02IM")
    return path


def matlab_73_struct(folder: Path) -> Path:
    import h5py

    path = folder / "seven_struct.mat"
    with h5py.File(path, "w") as file:
        group = file.create_group("log")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in (("Zeit_s", TIME_S), ("Weg_mm", INPUT_MM), ("Abstand_mm", GAP_MM)):
            group.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    return path


def parquet_units_in_names(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(
        pa.table({"time_ms": TIME_S * 1e3, "position_um": INPUT_MM * 1e3, "gap_mm": GAP_MM, "ok": [True] * ROWS}),
        folder / "a.parquet",
    )
    return folder / "a.parquet"


def parquet_stamps_and_metadata(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    stamps = pa.array((TIME_S * 1e9).astype("int64") + 1_714_730_400_123_456_789, pa.timestamp("ns"))
    fields = [
        pa.field("timestamp", pa.timestamp("ns")),
        *(pa.field(n, pa.float64(), metadata={"unit": "um"}) for n in ("stage", "opening")),
    ]
    table = pa.table([stamps, pa.array(INPUT_MM * 1e3), pa.array(GAP_MM * 1e3)], schema=pa.schema(fields))
    pq.write_table(table, folder / "b.parquet")
    return folder / "b.parquet"


def tdms_channels(folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    values = (("Time", TIME_S, "s"), ("Position", INPUT_MM * 1e3, "µm"), ("Gap", GAP_MM, "mm"))
    with TdmsWriter(folder / "a.tdms") as writer:
        writer.write_segment([ChannelObject("Log", n, v, {"unit_string": u}) for n, v, u in values])
    return folder / "a.tdms"


def tdms_waveforms(folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    wave = {"wf_start_offset": 0.0, "wf_increment": 0.1, "wf_samples": ROWS}
    with TdmsWriter(folder / "b.tdms") as writer:
        writer.write_segment([
            ChannelObject("Log", "Position", INPUT_MM, {"unit_string": "mm", **wave}),
            ChannelObject("Log", "Gap", GAP_MM, {"unit_string": "mm", **wave}),
        ])  # fmt: skip
    return folder / "b.tdms"


READ: tuple[Callable[[Path], Path], ...] = (
    excel_numbers_as_text, excel_midnight_and_statistics, modelica_result, excel_plain, excel_title_and_units_row, excel_offset_columns, excel_dates, excel_notes_beside, excel_merged_title,
    matlab_struct, matlab_vectors_beside_others, matlab_4, matlab_73, matlab_73_struct, parquet_units_in_names,
    parquet_stamps_and_metadata, tdms_channels, tdms_waveforms,
)  # fmt: skip
"""Makers of measured tables that hold `TRUTH`."""


def excel_two_tables(folder: Path) -> Path:
    head, rows = ["time (s)", "position (mm)", "gap (mm)"], rows_of(TIME_S, INPUT_MM, GAP_MM)
    return workbook(
        folder / "two.xlsx", [head], [[t, x, g + 1.0] for t, x, g in rows], title="Run 1", **{"Run 2": [head, *rows]}
    )


def matlab_matrix(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "matrix.mat", {"data": np.column_stack([TIME_S, INPUT_MM, GAP_MM])})
    return folder / "matrix.mat"


def matlab_without_units(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "plain.mat", {"t": TIME_S, "x": INPUT_MM * 1e3, "gap": GAP_MM})
    return folder / "plain.mat"


def tdms_two_groups(folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(folder / "two.tdms") as writer:
        for group, shift in (("A", 1.0), ("B", 0.0)):
            values = (("Time", TIME_S, "s"), ("Position", INPUT_MM, "mm"), ("Gap", GAP_MM + shift, "mm"))
            writer.write_segment([ChannelObject(group, n, v, {"unit_string": u}) for n, v, u in values])
    return folder / "two.tdms"


UNITS = ("units.time=s", "units.input=mm", "units.gap=mm")
ASKED: tuple[tuple[Callable[[Path], Path], str, tuple[str, ...]], ...] = (
    (excel_two_tables, "part", ("part=Run 2",)),
    (matlab_matrix, "columns.input", ("columns.time=1", "columns.input=2", "columns.gap=3", *UNITS)),
    (matlab_without_units, "units.input", ("units.time=s", "units.input=um", "units.gap=mm")),
    (tdms_two_groups, "part", ("part=B",)),
)
"""Makers of tables that need a decision, the key that is asked for, and what is then stated."""
