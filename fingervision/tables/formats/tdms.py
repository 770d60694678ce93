"""National Instruments' .tdms files, read with npTDMS: the channels of one group."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.needed_library import needed_library
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.parts import chosen_part, numbers
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.units import column_name

ORDER = 50
MOST_VALUES = 50_000_000
WORDS = 200
"""Number of characters of a warning that are reported."""
UNIT_KEYS = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def recognises(path: Path, head: bytes) -> bool:
    """Whether the first bytes of a file are those of a .tdms file."""
    return head.startswith(b"TDSm")


def read(path: Path, given: Entry) -> RawTable:
    """Read the channels of a group; times are a channel, or follow from the sampling rate of the waveform."""
    library = needed_library("nptdms", "formats", f"{path} is a TDMS file, which", "save the table as CSV")
    warned: list[str] = []
    with _warnings(warned), path.open("rb") as opened, library.TdmsFile.open(opened) as file:
        groups = {group.name: group.channels() for group in file.groups() if group.channels()}
        total = sum(len(channel) for channels in groups.values() for channel in channels)
        _check_size(path, total)
        name = chosen_part(path, {each: [c.name for c in cs] for each, cs in groups.items()}, given, "group")
        columns, passed = _columns(groups[name])
    lengths = {len(column) for column in columns}
    if len(lengths) != 1:
        listed = ", ".join(f"{column.name} {len(column)}" for column in columns) or "none"
        raise DataError(
            f"The channels of group '{name}' of {path} must have the same number of values, but have: {listed}. Save "
            f"the channels of each sampling rate in a separate group."
        )
    notes = (f"Not read, because they are not channels of numbers: {', '.join(passed)}.",) if passed else ()
    if warned:
        notes = (*notes, f"The file is damaged or was cut off ({warned[0]}); what could be read was used.")
    return RawTable(path, f"TDMS, group '{name}'", tuple(columns), notes=notes, settings={"part": name})


@contextmanager
def _warnings(into: list[str]) -> Iterator[None]:
    """Collect damage that npTDMS logs, instead of printing it to the terminal."""
    # npTDMS gives each of its modules a separate logger and handler.
    loggers = [log for name, log in logging.root.manager.loggerDict.items() if name.startswith("nptdms.")]
    kept = [(log, log.handlers, log.propagate) for log in loggers if isinstance(log, logging.Logger)]
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: into.append(record.getMessage()[:WORDS])  # type: ignore[method-assign]
    try:
        for log, _, _ in kept:
            log.handlers, log.propagate = [handler], False
        yield
    finally:
        for log, handlers, propagate in kept:
            log.handlers, log.propagate = handlers, propagate


def _check_size(path: Path, values: int) -> None:
    """Refuse a file that is too large, before its values are read."""
    if values > MOST_VALUES:
        raise DataError(f"{path} must have at most {MOST_VALUES} values, but has {values}: split it.")


def _columns(channels: list[Any]) -> tuple[list[RawColumn], list[str]]:
    columns, passed = [], []
    for channel in channels:
        values = channel[:]
        unit = next((str(channel.properties[key]) for key in UNIT_KEYS if channel.properties.get(key)), "")
        if values.dtype.kind == "M":
            ticks = values.astype("datetime64[ns]").astype(np.int64)
            seconds = (ticks - (ticks[0] if ticks.size else 0)) / 1e9
            columns.append(RawColumn(channel.name, Numbers.whole(seconds), "s", str(values[0]) if ticks.size else ""))
        elif values.dtype.kind in "fiub":
            columns.append(RawColumn(channel.name, numbers(values), unit))
        elif values.dtype.kind in "OU":
            columns.append(RawColumn(channel.name, [str(each) for each in values]))
        else:
            passed.append(channel.name)
    if not any(column_name(column.name).role == "time" for column in columns):
        steps = {
            (float(c.properties.get("wf_start_offset", 0.0)), float(c.properties["wf_increment"]))
            for c in channels
            if "wf_increment" in c.properties
        }
        if len(steps) == 1 and columns:
            start, step = steps.pop()
            if step > 0.0:
                time = start + step * np.arange(len(columns[0]), dtype=np.float64)
                columns.insert(0, RawColumn("Time", Numbers.whole(time), "s"))
    return columns, passed
