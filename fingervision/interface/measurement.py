"""The result of `fingervision.measure`: the rows of gaps.csv, with methods to print, draw and save them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from calib.budget import Budget
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import UsageError
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.measured_table import MeasuredTable
from fingervision.interface.argument_checks import in_python, path_of, python_words, speaks_python, whole_number
from fingervision.interface.frame_sources import Opener
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.words import in_one_line, result_sentences
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.gauge_files import GaugeRow

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class Measurement:
    """The gap in every frame of a recording with its uncertainty, or the reason why a frame has none.

    Made by `fingervision.measure`. Iterating gives one row per frame with the fields of gaps.csv; None stands for a
    missing value.

    Parameters
    ----------
    _found : MeasuredInMemory
        Rows, series and summary.
    _again : callable
        Function that opens the recording again, to draw pictures.

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
        """The rows of gaps.csv, one per frame."""
        return self._found.rows

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of gaps.csv, in its order."""
        from fingervision.interface.measurement_tables import columns_of

        return columns_of(self._found)

    @property
    def gap_mm(self) -> NDArray[np.float64]:
        """Gaps of the frames that have a gap, shape (n,); `frames_ok` gives the numbers of these frames."""
        return self._found.series.gap_mm

    @property
    def u_gap_mm(self) -> NDArray[np.float64] | None:
        """Standard uncertainties of `gap_mm`, shape (n,); None if the scale was stated without an uncertainty."""
        return self._found.series.u_mm if self._found.series.has_budget else None

    @property
    def u_random_mm(self) -> NDArray[np.float64]:
        """Random part of the standard uncertainties of `gap_mm`, which changes from frame to frame; shape (n,) (mm)."""
        return self._found.series.u_random_mm

    @property
    def frames_ok(self) -> NDArray[np.int64]:
        """Numbers of the frames that have a gap, shape (n,)."""
        return self._found.series.frame_numbers()[0]

    @property
    def time_s(self) -> NDArray[np.float64] | None:
        """Times of the frames that have a gap, shape (n,); None if the recording has no times."""
        times = self._found.series.times_s()
        return None if times is None else times[0]

    @property
    def counts(self) -> dict[str, int]:
        """Number of frames by status."""
        return {status.value: count for status, count in self._found.series.counts.most_common()}

    @property
    def summary(self) -> dict[str, Any]:
        """The content of summary.json."""
        return self._found.summary

    @property
    def advice(self) -> tuple[str, ...]:
        """Sentences on what to change in the recording, and remarks; if no frame has an input, first the reason."""
        refusal = () if self.no_input is None else (self.no_input,)
        return (*refusal, *self._found.summary["advice"])

    @property
    def no_input(self) -> str | None:
        """Reason why no frame got an input although a drive was given; None otherwise.

        In this case the gaps are measured nonetheless. `measured_table()` then raises an error with the same sentence.
        """
        return None if self._found.refusal is None else in_python(str(self._found.refusal))

    @property
    def budget(self) -> Budget:
        """Uncertainty budget of `gap_mm`, with every source and its standard uncertainty for each gap, shape (n,).

        The squares of the contributions add to the square of `u_gap_mm` (JCGM 100:2008, equation 10); the contribution
        that is not `shared` is `u_random_mm`. With a scale that has no stated uncertainty, only the contributions of
        the pictures are listed. `print(measured.budget.table())` prints the sources of the first gap, the largest
        first.

        Raises
        ------
        UsageError
            No frame has a gap.
        """
        from fingervision.measuring.gap_budget import gap_budget

        outcomes = [result.outcome for result in self._found.results]
        measured = [each for each in outcomes if isinstance(each, GapMeasurement)]
        if not measured:
            raise UsageError(
                "A budget needs at least one measured gap, but no frame has one: `counts` and `advice` give the "
                "reasons."
            )
        return gap_budget(measured, self._found.task.scale)

    @property
    def gauge_rows(self) -> tuple[GaugeRow, ...]:
        """Readings of the gauges, one row per value, as in gauges.csv; empty without gauges."""
        return self._found.gauge_rows

    @property
    def drive(self) -> DriveHistory | None:
        """The recorded input (drive) that was assigned to the frames."""
        return self._found.task.drive

    def measured_table(self) -> MeasuredTable:
        """Return the frames that have a gap and an input as a measured table, rounded as in gaps.csv.

        Raises
        ------
        UsageError
            The measurement has no drive.
        DataError, NoCalibrationError
            Too few frames have both a gap and an input, or the input does not change.
        """
        from fingervision.interface.measurement_tables import measured_table

        with python_words():
            return measured_table(self._found)

    def report(self) -> str:
        """Return the result as the command prints it."""
        lines = result_sentences(self._found.summary, self._found.series)
        return "\n".join([*lines, *([self.no_input] if self.no_input else [])])

    def __repr__(self) -> str:
        return f"Measurement({in_one_line(self._found.summary, self._found.series)})"

    def _repr_html_(self) -> str:
        """HTML for a notebook: the measured edges of a single frame, or the gap over time of a recording."""
        from fingervision.interface.measurement_pictures import cell_html

        return cell_html(self._found, self._again)

    def picture(self, frame: int = 0) -> NDArray[np.uint8]:
        """Draw the measured edges, tips, measuring points and the value into a frame.

        Parameters
        ----------
        frame : int
            Number of the frame in the recording, from 0. The recording is read again up to this frame.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Red, green and blue.

        Raises
        ------
        UsageError
            The recording has no frame of that number, or the frame could not be read.
        """
        from fingervision.interface.measurement_pictures import marked_picture

        return marked_picture(self._found, self._again, whole_number("frame", frame, 0))

    def to_dataframe(self) -> "pd.DataFrame":
        """Give the rows as a pandas DataFrame with the columns of gaps.csv.

        Numeric columns have pandas' nullable types (`Float64`, `Int64`); a missing value is `pandas.NA`.

        Raises
        ------
        MissingLibraryError
            pandas is not installed (it comes with the extra `dataframe`).
        """
        from fingervision.interface.measurement_tables import dataframe

        return dataframe(self._found)

    def to_xarray(self) -> "xr.Dataset":
        """Return the rows as an xarray Dataset over the dimension `frame`, with `time_s` as a coordinate.

        Every variable of the Dataset has its unit as an attribute. A missing value is NaN, because xarray has no other
        marker; `status` gives the reason.

        Raises
        ------
        MissingLibraryError
            xarray is not installed (it comes with the extra `dataframe`).
        """
        from fingervision.interface.measurement_tables import dataset

        return dataset(self._found)

    def plot(self, axes: "tuple[Axes, Axes] | None" = None) -> "tuple[Axes, Axes]":
        """Draw the gap over time with its expanded uncertainty (k = 2), as in gap.png.

        Parameters
        ----------
        axes : (Axes, Axes) or None
            Matplotlib axes for the gap and for its uncertainty; None makes a new figure.

        Returns
        -------
        (Axes, Axes)
            The axes of the gap and of its uncertainty.
        """
        from fingervision.interface.measurement_pictures import plotted

        return plotted(self._found, axes)

    @speaks_python
    def save(self, folder: str | Path, *, overlay: bool = False, steps: int | None = None) -> Path:
        """Write what `fingervision measure --out FOLDER` writes: gaps.csv, summary.json, gap.png.

        Parameters
        ----------
        folder : path
            The folder, which is created if it does not exist. A folder with the results of another recording is
            refused.
        overlay : bool
            Also write overlay.mp4.
        steps : int or None
            Number of a frame of which the pictures of all processing steps are also written.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        UsageError
            The folder holds the results of another recording, or there is no such frame.
        OutputError
            The file or folder cannot be written.
        """
        from fingervision.measuring.output_folder import save_measured

        out = path_of("folder", folder, "a folder")
        steps_frame = None if steps is None else whole_number("steps", steps, 0)
        return save_measured(self._found, self._again(), out, overlay=overlay, steps_frame=steps_frame).path
