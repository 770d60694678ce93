"""What `fingervision.measure` gives back: the rows of gaps.csv as an object that prints, draws and saves itself."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import MissingLibraryError, UsageError
from fingervision.domain.frame import Frame
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.status import Status
from fingervision.interface.argument_checks import path_of, whole_number
from fingervision.interface.argument_names import speaks_python
from fingervision.interface.frame_sources import Opener
from fingervision.interface.notebook import image_html, png_of, png_of_figure
from fingervision.measuring.clock.alignment import ClockOffset
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.outcome import clock_drawn
from fingervision.measuring.words import in_one_line, result_sentences
from fingervision.storage.gaps_csv import COLUMNS, FORCE_PLACES, MM_PLACES, TIME_PLACES, GapRow

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

TEXTS = ("status", "fingers", "run")


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """The gap in every frame of a recording, with its uncertainty; or why a frame has none.

    Made by `fingervision.measure`. Iterating gives one row a frame, with the fields of gaps.csv; None stands where
    there is no value.

    Parameters
    ----------
    _found : MeasuredInMemory
        Rows, series and summary.
    _again : callable
        Opens the recording once more, for pictures.

    Examples
    --------
    >>> import fingervision as fv
    >>> from fingervision.rendering import two_fingers, Camera, render
    >>> import numpy as np
    >>> picture = render(two_fingers(68.0, below_tip_px=10.2), Camera(), np.random.default_rng(1))
    >>> measured = fv.measure(picture, px_per_mm=34.0)
    >>> len(measured)
    1
    >>> round(measured[0].gap_mm, 2)
    2.0
    """

    _found: MeasuredInMemory
    _again: Opener = field(repr=False)

    def __len__(self) -> int:
        return len(self._found.rows)

    def __iter__(self) -> Iterator[GapRow]:
        return iter(self._found.rows)

    @overload
    def __getitem__(self, frame: int) -> GapRow: ...

    @overload
    def __getitem__(self, frame: slice) -> tuple[GapRow, ...]: ...

    def __getitem__(self, frame: int | slice) -> GapRow | tuple[GapRow, ...]:
        return self._found.rows[frame]

    @property
    def rows(self) -> tuple[GapRow, ...]:
        """One row a frame."""
        return self._found.rows

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of gaps.csv, in its order."""
        return (*COLUMNS.split(","), *self._found.task.drive_columns)

    @property
    def gap_mm(self) -> NDArray[np.float64]:
        """Gaps of the frames that have one, shape (n,); `frames_ok` says which these are."""
        return self._found.series.gap_mm

    @property
    def u_gap_mm(self) -> NDArray[np.float64] | None:
        """Their standard uncertainties, shape (n,); None where the scale was stated without an uncertainty."""
        return self._found.series.u_mm if self._found.series.has_budget else None

    @property
    def u_random_mm(self) -> NDArray[np.float64]:
        """The random part of their standard uncertainties, from frame to frame, shape (n,)."""
        return self._found.series.u_random_mm

    @property
    def frames_ok(self) -> NDArray[np.int64]:
        """Numbers of the frames that have a gap, shape (n,)."""
        return self._found.series.frame_numbers()[0]

    @property
    def time_s(self) -> NDArray[np.float64] | None:
        """Times of the frames that have a gap, shape (n,); None where the recording has no times."""
        times = self._found.series.times_s()
        return None if times is None else times[0]

    @property
    def counts(self) -> dict[str, int]:
        """Frames with each status that there is."""
        return {status.value: count for status, count in self._found.series.counts.most_common()}

    @property
    def summary(self) -> dict[str, Any]:
        """What summary.json holds."""
        return self._found.summary

    @property
    def advice(self) -> tuple[str, ...]:
        """What to change, and what to know, in sentences."""
        return tuple(self._found.summary["advice"])

    @property
    def drive(self) -> DriveHistory | None:
        """The recorded input that the frames were joined with."""
        return self._found.task.drive

    def measured_table(self) -> MeasuredTable:
        """Give the frames that have a gap and an input as a measured table, with the digits that gaps.csv has.

        Raises
        ------
        UsageError
            The measurement has no drive.
        FingervisionError
            There are too few such frames, or they do not move.
        """
        from fingervision.interface.column_tables import measured_from_columns
        from fingervision.storage.line_file import cell
        from fingervision.storage.measured_table import NUMBERS

        task, clock = self._found.task, self._found.clock
        if task.drive is None:
            raise UsageError("measured must have a drive, but was measured without: give fingervision.measure one.")
        columns: dict[str, list[Any]] = {
            name: [
                float(cell(value, _places(name))) if value is not None else None
                for value in (_cell(row, name) for row in self)
            ]
            for name in NUMBERS
            if name in self.columns
        }
        columns["run"] = [row.run for row in self]
        table = measured_from_columns(columns)
        return replace(table, u_clock_s=clock.u_time_s) if isinstance(clock, ClockOffset) else table

    def report(self) -> str:
        """Say what was found as the command prints it."""
        return "\n".join(result_sentences(self._found.summary, self._found.series))

    def __repr__(self) -> str:
        return f"Measurement({in_one_line(self._found.summary, self._found.series)})"

    def _repr_html_(self) -> str:
        """Show the picture: what was measured in a single frame, the gap over time in a recording."""
        content = self._png()
        picture = "" if content is None else image_html(content)
        return f"<p>{escape(in_one_line(self._found.summary, self._found.series))}</p>{picture}"

    def _png(self) -> bytes | None:
        if len(self) != 1:
            from fingervision.measuring.gap_figure import gap_figure

            task = self._found.task
            return png_of_figure(gap_figure(self._found.series, task.drive, clock_drawn(self._found.clock, task)))
        if self._found.first_frame is None:
            return None
        return png_of(self.picture(0))

    def picture(self, frame: int = 0) -> NDArray[np.uint8]:
        """Draw what was measured into a frame: edges, tips, measuring points, and the value.

        Parameters
        ----------
        frame : int
            Its number, from 0. A recording is read up to it once more.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Red, green and blue.

        Raises
        ------
        UsageError
            There is no such frame, or it could not be read.
        """
        from fingervision.measuring.overlay_video import words_of_row
        from fingervision.vision.overlay import draw_overlay

        frame = whole_number("frame", frame, 0)
        first = self._found.first_frame
        found = first if first is not None and first.index == frame else None
        if found is None and frame < len(self):
            item = next((item for item in self._again() if item.index == frame), None)
            found = item if isinstance(item, Frame) else None
        outcome = self._found.results[frame].outcome if frame < len(self) else None
        if found is None or outcome is None or outcome.status in (Status.DAMAGED, Status.DUPLICATE):
            raise UsageError(f"frame must be one of the {len(self)} that can be read, but {frame} is not.")
        return draw_overlay(found, outcome, words_of_row(self._found.rows[frame]))  # type: ignore[arg-type]

    def to_dataframe(self) -> "pd.DataFrame":
        """Give the rows as a pandas DataFrame with the columns of gaps.csv.

        Numbers are of pandas' nullable types (`Float64`, `Int64`): what is missing is `pandas.NA`.

        Raises
        ------
        MissingLibraryError
            pandas is not installed (it comes with the extra `dataframe`).
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise MissingLibraryError("pandas", "dataframe", "to_dataframe") from error
        kinds = {"frame": "Int64", **dict.fromkeys(TEXTS, "string")}
        return pd.DataFrame(
            {
                name: pd.array([_cell(row, name) for row in self], dtype=kinds.get(name, "Float64"))
                for name in self.columns
            }
        )

    def to_xarray(self) -> "xr.Dataset":
        """Give the rows as an xarray Dataset over the dimension `frame`, with `time_s` as a coordinate.

        Every number has its unit as an attribute. xarray knows no missing number: NaN stands for it here, and `status`
        says why.

        Raises
        ------
        MissingLibraryError
            xarray is not installed (it comes with the extra `dataframe`).
        """
        try:
            import xarray as xr
        except ImportError as error:
            raise MissingLibraryError("xarray", "dataframe", "to_xarray") from error
        variables: dict[str, Any] = {}
        for name in self.columns[1:]:
            cells = [_cell(row, name) for row in self]
            if name in TEXTS:
                variables[name] = (("frame",), np.array(cells, dtype=object), {})
            else:
                numbers = np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
                variables[name] = (("frame",), numbers, {"units": name.rpartition("_")[2]})
        frames = np.array([row.frame for row in self], dtype=np.int64)
        made = xr.Dataset(variables, coords={"frame": frames}, attrs={"recording": self.summary["recording"]["name"]})
        return made.set_coords("time_s")

    def plot(self, axes: "tuple[Axes, Axes] | None" = None) -> "tuple[Axes, Axes]":
        """Draw the gap over time with its expanded uncertainty (k = 2), as gap.png has it.

        Parameters
        ----------
        axes : (Axes, Axes) or None
            Matplotlib axes for the gap and for its uncertainty; None makes a new figure of them.

        Returns
        -------
        (Axes, Axes)
            What was drawn in.
        """
        from fingervision.measuring.gap_figure import SIZE_INCHES, draw_gap_axes

        if axes is None:
            import matplotlib.pyplot as plt

            _, made = plt.subplots(2, 1, sharex=True, height_ratios=(3, 1), figsize=SIZE_INCHES, layout="constrained")
            axes = (made[0], made[1])
        upper, lower = axes
        task = self._found.task
        draw_gap_axes(upper, lower, self._found.series, task.drive, clock_drawn(self._found.clock, task))
        return upper, lower

    @speaks_python
    def save(self, folder: str | Path, *, overlay: bool = False, steps: int | None = None) -> Path:
        """Write what `fingervision measure --out FOLDER` writes: gaps.csv, summary.json, gap.png.

        Parameters
        ----------
        folder : path
            Made where it is not there. One with the results of another recording is refused.
        overlay : bool
            Also write overlay.mp4.
        steps : int or None
            Also write every step of this frame.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        UsageError
            The folder holds the results of another recording, or there is no such frame.
        FingervisionError
            It cannot be written.
        """
        from fingervision.measuring.save import save_measured

        out = path_of("folder", folder, "a folder")
        steps_frame = None if steps is None else whole_number("steps", steps, 0)
        return save_measured(self._found, self._again(), out, overlay=overlay, steps_frame=steps_frame).path


def _places(name: str) -> int:
    """Decimal places of a column of gaps.csv."""
    return {"time_s": TIME_PLACES, "force_n": FORCE_PLACES}.get(name, MM_PLACES)


def _cell(row: GapRow, name: str) -> Any:
    value = getattr(row, name)
    return value.value if isinstance(value, Status) else value


__all__ = ["Measurement"]
