"""Read the file gauges.toml: the gauges of one picture.

schema = 1
[[gauge]]
name = "lever"                       # unique in the file
kind = "edge"                        # edge | pair | line | circle | marker | patch | gap
x_px = 320.0                         # centre in the first frame, in pixels of the full frame
y_px = 200.0
direction_deg = 0.0                  # settings of the kind follow
length_px = 40.0
reach_px = 12.0                      # largest motion between frames; nothing similar may be within it
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.field import names_of
from fingervision.gauges.kinds import Kind, Spec, kind_named, kinds
from fingervision.storage.toml_section import Section, read_document, refuse_other_file

SCHEMA = 1
# Largest number of gauges, and largest length of a name; more would be a mistake in the file.
MOST_GAUGES, LONGEST_NAME = 1000, 100
# Keys that state sizes; a size larger than the frame's diagonal is refused, because the gauge cannot be in view.
SIZES = ("length_px", "distance_px", "diameter_px", "width_px", "height_px", "size_px")


@dataclass(frozen=True, slots=True)
class Gauge:
    """One named gauge.

    Parameters
    ----------
    name : str
        Name given by the user.
    kind_name : str
        Name of its kind.
    spec : Spec
        Settings of the gauge.
    """

    name: str
    kind_name: str
    spec: Spec

    @property
    def kind(self) -> Kind:
        """Module that defines the kind of a gauge."""
        return kind_named(self.kind_name)

    @property
    def quantities(self) -> tuple[tuple[str, str], ...]:
        """Name of each of the gauge's quantities, and whether it is a length or an angle."""
        return self.kind.QUANTITIES

    @property
    def asks_for_fingers(self) -> bool:
        """Whether the gauge measures the gap between fingers."""
        return getattr(self.kind, "ASKS_FOR_FINGERS", False)


def read_gauges(path: Path) -> tuple[Gauge, ...]:
    """Read a file of gauges.

    Raises
    ------
    DataError, InputFileError
        If the file cannot be read, or a value in it is not allowed; the sentence names the line.
    """
    return gauges_in(path, *read_document(path, "gauge file"))


def gauges_in(path: Path, values: Mapping[str, Any], text: str) -> tuple[Gauge, ...]:
    """Make the gauges from the content of a file.

    Parameters
    ----------
    path : Path
        Path of the file, for error messages.
    values : mapping
        Parsed tables of the file.
    text : str
        Text of the file.

    Raises
    ------
    DataError
        If a value is not allowed; the sentence names the line.
    """
    refuse_other_file(path, values, "a gauge file", ["a gauge file"])
    top = Section(path, text, "", values)
    top.only(("schema", "gauge"))
    schema = top.whole("schema", low=1)
    if schema != SCHEMA:
        top.refuse("schema", f"must be {SCHEMA}, but is {schema}: this program is older than the file.")
    sections = top.tables("gauge")
    if not 1 <= len(sections) <= MOST_GAUGES:
        raise DataError(
            f"{path} must contain 1 to {MOST_GAUGES} tables [[gauge]], but contains {len(sections)}: add "
            "or remove gauges."
        )
    gauges: dict[str, Gauge] = {}
    for section in sections:
        gauge = gauge_of(section, gauges)
        gauges[gauge.name] = gauge
    return tuple(gauges.values())


def gauge_of(section: Section, others: Collection[str]) -> Gauge:
    """Make one gauge from its table in the file.

    Parameters
    ----------
    section : Section
        Table of the gauge.
    others : collection of str
        Names that are already in use.

    Raises
    ------
    DataError
        If a value is not allowed.
    """
    name = section.word("name")
    if not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
        section.refuse("name", f"must be 1 to {LONGEST_NAME} printable characters, but is {name[:200]!r}.")
    if name in others:
        section.refuse("name", f"must be unique in the file, but {name!r} occurs twice: rename one of the gauges.")
    kind_name = section.word("kind", of=kinds())
    kind = kind_named(kind_name)
    keys = names_of(kind.SPEC)
    section.only(("name", "kind", *keys))
    own = {key: value for key, value in section.values.items() if key in keys}
    return Gauge(name, kind_name, replace(section, values=own).record(kind.SPEC))


def check_gauges(gauges: tuple[Gauge, ...], width_px: int, height_px: int) -> None:
    """Refuse gauges whose centre lies outside the frames.

    Raises
    ------
    DataError
        A gauge lies outside the picture or is larger than it; the message names the gauge.
    """
    for gauge in gauges:
        x, y = gauge.spec.middle_px
        if not (-0.5 <= x <= width_px - 0.5 and -0.5 <= y <= height_px - 0.5):
            raise DataError(
                f"The gauge {gauge.name!r} must have its centre inside the picture of {width_px}x{height_px} "
                f"pixels, but its centre is at x_px = {x:g}, y_px = {y:g}: move the gauge into the picture."
            )
        largest = (width_px**2 + height_px**2) ** 0.5
        for key in SIZES:
            size = getattr(gauge.spec, key, 0.0)
            if size > largest:
                raise DataError(
                    f"The gauge {gauge.name!r} must be smaller than the picture of {width_px}x{height_px} pixels, but "
                    f"its {key} is {size:g}: reduce {key}."
                )
