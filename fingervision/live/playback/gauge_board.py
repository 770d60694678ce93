"""Gauges that are edited in the browser page: added, changed, removed, read from a file and saved to it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any, NoReturn

from fingervision.domain.errors import DataError, FingervisionError, StateError
from fingervision.gauges.gauge_file import MOST_GAUGES, SCHEMA, Gauge, check_gauges, gauge_of, gauges_in
from fingervision.storage.gauge_files import gauges_text, text_of, write_gauges_text
from fingervision.storage.toml_section import Section, read_document

USUAL_FILE = Path("gauges.toml")
# Keys of the position, which every kind of gauge has; the position must lie inside the frame.
PLACE = ("x_px", "y_px")


class FieldError(FingervisionError):
    """A value of a gauge is not allowed; the error contains the name of the setting.

    Parameters
    ----------
    field : str or None
        Name of the setting; None if the error concerns the gauge as a whole.
    words : str
        Sentence that states the reason.
    """

    def __init__(self, field: str | None, words: str) -> None:
        super().__init__(words)
        self.field = field


class ChangedMeanwhileError(FingervisionError):
    """The gauge file was changed by another program since it was read."""


@dataclass(frozen=True, slots=True)
class _Typed(Section):
    """Settings of a gauge that was entered in the browser page, and hence has no line number in a file."""

    def refuse(self, key: str | None, words: str) -> NoReturn:
        raise FieldError(key, f"{self.header if key is None else key} {words}")


@dataclass(frozen=True, slots=True)
class _Entry:
    table: Mapping[str, Any]
    place: int | None
    gauge: Gauge


class GaugeBoard:
    """The gauges of one recording, and the file in which they are stored.

    Parameters
    ----------
    path : Path
        The file of gauges; read if it exists.
    frame_size_px : (int, int)
        Width and height of the frames.

    Raises
    ------
    FingervisionError
        The file exists but cannot be read, or its gauges do not fit these frames.
    """

    def __init__(self, path: Path, frame_size_px: tuple[int, int]) -> None:
        self.path, self.frame_size_px = path, frame_size_px
        self._lock = Lock()
        self._entries: tuple[_Entry, ...] = ()
        self._before: str | None = None
        self._kept: list[Mapping[str, Any]] = []
        self.version = 0
        """Number that increases with every change."""
        self.load()

    @property
    def gauges(self) -> tuple[Gauge, ...]:
        """The gauges, in the order of the file."""
        return tuple(entry.gauge for entry in self._entries)

    @property
    def tables(self) -> list[Mapping[str, Any]]:
        """Settings of the gauges in the form in which they are stored in the file."""
        return [entry.table for entry in self._entries]

    @property
    def is_saved(self) -> bool:
        """Whether the gauge file contains exactly the present gauges."""
        return self.tables == self._kept

    def snapshot(self) -> tuple[int, tuple[Gauge, ...]]:
        """Return a consistent pair of version number and gauges."""
        with self._lock:
            return self.version, self.gauges

    # ---- the file
    def load(self) -> None:
        """Read the gauges from the file, discarding unsaved changes; without a file there are no gauges.

        Raises
        ------
        DataError, InputFileError
            The file cannot be read, or holds gauges that do not fit these frames; the present gauges are then kept.
        """
        before = text_of(self.path)
        entries: tuple[_Entry, ...] = ()
        if before is not None:
            values, before = read_document(self.path, "gauge file")
            gauges = gauges_in(self.path, values, before)
            check_gauges(gauges, *self.frame_size_px)
            entries = tuple(
                _Entry(table, place, gauge)
                for place, (table, gauge) in enumerate(zip(values["gauge"], gauges, strict=True))
            )
        with self._lock:
            self._entries, self._before = entries, before
            self._kept = self.tables
            self.version += 1

    def save(self, *, over: bool = False) -> None:
        """Write the gauges to the file.

        Parameters
        ----------
        over : bool
            Whether to overwrite a file that another program has changed since it was read.

        Raises
        ------
        ChangedMeanwhileError
            Another program has changed the file, and `over` is false.
        DataError, InputFileError, OutputError
            There is no gauge to save, or the file cannot be written; its earlier version is then kept.
        """
        with self._lock:
            if not self._entries:
                raise DataError("A gauge file must hold at least one gauge, but there is none: add one.")
            if not over and self._now() != self._before:
                raise ChangedMeanwhileError(
                    f"{self.path} was changed by another program since it was read here: load the changed file and "
                    "lose the changes made here, or overwrite the changed file."
                )
            text = gauges_text([(entry.table, entry.place) for entry in self._entries], self._before, SCHEMA)
            write_gauges_text(self.path, text)
            self._before = text
            self._entries = tuple(_Entry(entry.table, place, entry.gauge) for place, entry in enumerate(self._entries))
            self._kept = self.tables

    def _now(self) -> str | None:
        try:
            return text_of(self.path)
        except FingervisionError as error:
            raise ChangedMeanwhileError(f"{error} Overwrite the file, or correct its errors first.") from error

    # ---- one gauge
    def add(self, table: Mapping[str, Any]) -> None:
        """Add a gauge.

        Raises
        ------
        DataError, FieldError, StateError
            A value is not allowed (a `FieldError` names its key), or the file holds no more gauges.
        """
        with self._lock:
            if len(self._entries) >= MOST_GAUGES:
                raise StateError(f"A gauge file holds at most {MOST_GAUGES} gauges: remove a gauge first.")
            self._entries += (self._entry(table, None, self._entries),)
            self.version += 1

    def change(self, name: str, changes: Mapping[str, Any]) -> None:
        """Change the values of a gauge, including its name.

        Parameters
        ----------
        name : str
            The gauge.
        changes : mapping
            New values of settings by name; None removes a setting.

        Raises
        ------
        DataError, FieldError, StateError
            No gauge has that name, or a value is not allowed; the gauge is then unchanged.
        """
        with self._lock:
            at = self._at(name)
            others = self._entries[:at] + self._entries[at + 1 :]
            table = {**self._entries[at].table, **changes}
            table = {key: value for key, value in table.items() if value is not None}
            entry = self._entry(table, self._entries[at].place, others)
            self._entries = (*self._entries[:at], entry, *self._entries[at + 1 :])
            self.version += 1

    def remove(self, name: str) -> None:
        """Remove a gauge.

        Raises
        ------
        StateError
            No gauge has that name.
        """
        with self._lock:
            at = self._at(name)
            self._entries = self._entries[:at] + self._entries[at + 1 :]
            self.version += 1

    def _at(self, name: str) -> int:
        for at, entry in enumerate(self._entries):
            if entry.gauge.name == name:
                return at
        raise StateError(f"There is no gauge {name!r} any more: reload the browser page.")

    def _entry(self, table: Mapping[str, Any], place: int | None, others: tuple[_Entry, ...]) -> _Entry:
        section = _Typed(self.path, "", "The gauge", table)
        gauge = gauge_of(section, {other.gauge.name for other in others})
        try:
            check_gauges((gauge,), *self.frame_size_px)
        except FingervisionError as error:
            outside = [
                key
                for key, of, side in zip(PLACE, gauge.spec.middle_px, self.frame_size_px, strict=True)
                if not -0.5 <= of <= side - 0.5
            ]
            raise FieldError(outside[0] if outside else None, str(error)) from error
        return _Entry(dict(table), place, gauge)
