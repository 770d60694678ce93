"""A measurement as a table for other software: pandas, xarray, or the measured table that `diagnose` takes."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fingervision.domain.errors import UsageError
from fingervision.domain.field import declared
from fingervision.domain.measured_table import ONE_CLOCK, FoundClock, MeasuredTable
from fingervision.domain.needed_library import needed_library
from fingervision.domain.status import Status
from fingervision.interface.column_tables import measured_from_columns
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.outcome import log_on_the_recording
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.motion.time_stamps import frame_resolution_s
from fingervision.storage.beside import response_note
from fingervision.storage.gaps_csv import COLUMNS, GapRow
from fingervision.storage.measured_table import NUMBERS
from fingervision.storage.row_file import cell

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

TEXTS = ("status", "fingers", "run")


def columns_of(found: MeasuredInMemory) -> tuple[str, ...]:
    """Names of the columns of gaps.csv, in its order."""
    return (*COLUMNS.split(","), *found.task.drive_columns)


def measured_table(found: MeasuredInMemory) -> MeasuredTable:
    """Return the frames that have a gap and an input as a measured table, rounded as in gaps.csv.

    Raises
    ------
    UsageError
        The measurement has no drive.
    DataError
        No frame has an input from the drive, there are too few such frames, or the input does not change.
    """
    task, clock = found.task, found.clock
    if task.drive is None:
        raise UsageError(
            "The measurement must include a drive (the stage's record), but was made without one: call "
            "fingervision.measure with drive=."
        )
    if found.refusal is not None:
        raise found.refusal
    known = columns_of(found)
    places = {each.name: each.field.places for each in declared(GapRow)}
    columns: dict[str, list[Any]] = {
        name: [
            float(cell(value, places[name])) if value is not None else None
            for value in (_cell(row, name) for row in found.rows)
        ]
        for name in NUMBERS
        if name in known
    }
    columns["run"] = [row.run for row in found.rows]
    table = measured_from_columns(columns)
    shifts_px = [row.u_shift_px for row in found.rows if row.u_shift_px is not None]
    table = replace(table, notes=(*table.notes, *response_note(found.summary, shifts_px)))
    stamp_s = 0.0 if table.time_s is None else frame_resolution_s(table.time_s)
    found_clock = ONE_CLOCK
    if isinstance(clock, ClockOffset):
        found_clock = FoundClock(clock.u_time_s, clock.corner_s, clock.u_corner_s)
    return replace(table, clock=found_clock, log=log_on_the_recording(clock, task), stamp_s=stamp_s)


def dataframe(found: MeasuredInMemory) -> "pd.DataFrame":
    """Return the rows as a pandas DataFrame with the columns of gaps.csv; a missing value is `pandas.NA`.

    Raises
    ------
    MissingLibraryError
        pandas is not installed.
    """
    pandas = needed_library("pandas", "dataframe", "to_dataframe")
    kinds = {"frame": "Int64", **dict.fromkeys(TEXTS, "string")}
    frame: pd.DataFrame = pandas.DataFrame(
        {
            name: pandas.array([_cell(row, name) for row in found.rows], dtype=kinds.get(name, "Float64"))
            for name in columns_of(found)
        }
    )
    return frame


def dataset(found: MeasuredInMemory) -> "xr.Dataset":
    """Return the rows as an xarray Dataset over the dimension `frame`; a missing number is NaN.

    Raises
    ------
    MissingLibraryError
        xarray is not installed.
    """
    xarray = needed_library("xarray", "dataframe", "to_xarray")
    variables: dict[str, Any] = {}
    for name in columns_of(found)[1:]:
        cells = [_cell(row, name) for row in found.rows]
        if name in TEXTS:
            variables[name] = (("frame",), np.array(cells, dtype=object), {})
        else:
            numbers = np.array([np.nan if each is None else each for each in cells], dtype=np.float64)
            variables[name] = (("frame",), numbers, {"units": name.rpartition("_")[2]})
    frames = np.array([row.frame for row in found.rows], dtype=np.int64)
    made: xr.Dataset = xarray.Dataset(
        variables, coords={"frame": frames}, attrs={"recording": found.summary["recording"]["name"]}
    )
    return made.set_coords("time_s")


def _cell(row: GapRow, name: str) -> Any:
    value = getattr(row, name)
    return value.value if isinstance(value, Status) else value
