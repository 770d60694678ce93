"""`fingervision.Calibration`: a scale with its uncertainty, with methods to load, save, print and check it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.gauge_study import Agreement
from calib.known_widths import KnownSize, find_widths
from calib.measured_scale import Calibration as MeasuredScale
from fingervision.interface.argument_checks import path_of, region_of
from fingervision.interface.argument_names import speaks_python
from fingervision.interface.calibration_report import budget_lines, scale_lines
from fingervision.interface.picture_response import PictureResponse
from fingervision.storage.calibration_json import read_calibration, refuse_foreign, write_calibration, write_picture

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """Pixels to millimetres with an uncertainty: gap_mm = (gap_px + b) / s for a light gap between dark fingers.

    A calibration is made by `fingervision.calibrate`, or read by `Calibration.load`.

    Parameters
    ----------
    scale : calib.Calibration
        The scale, its budget, and the references from which it was determined.
    path : Path or None
        The file from which the calibration was read; None for a new calibration.
    lines : tuple of str
        Findings of the calibration, in sentences.
    pictures : mapping of str to ndarray of uint8, shape (height, width, 3)
        Each picture (red, green, blue) with the detected edges drawn in.
    details : mapping
        Numbers of the fit, for programs.

    Examples
    --------
    >>> import fingervision as fv
    >>> calibration = fv.Calibration.load("sample_frames/reference/calibration.json")
    >>> calibration
    Calibration(34.0001 px/mm, U = 0.0044 px/mm (k = 2), edge bias -0.0001 px, for 640x480 pixels)
    """

    scale: MeasuredScale
    path: Path | None = None
    lines: tuple[str, ...] = ()
    pictures: "Mapping[str, NDArray[np.uint8]]" = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    @speaks_python
    def load(cls, path: "str | Path") -> "Calibration":
        """Read a calibration.json.

        Raises
        ------
        DataError, InputFileError
            The file does not exist, or is not a calibration.
        """
        name = path_of("path", path, "a calibration file")
        return cls(read_calibration(name), name)

    @speaks_python
    def save(self, path: "str | Path" = "calibration.json", *, pictures: bool = False) -> Path:
        """Write the calibration to a file, as `fingervision calibrate` does.

        Parameters
        ----------
        path : path
            An existing calibration of this name is replaced; any other existing file is refused.
        pictures : bool
            Also write each picture with the found edges drawn in, in the same folder.

        Raises
        ------
        OutputError
            The calibration cannot be written, or the path is that of another kind of file.
        """
        out = path_of("path", path, "a calibration file")
        refuse_foreign(out)
        write_calibration(self.scale, out)
        if pictures:
            self.save_pictures(out)
        return out

    def save_pictures(self, path: Path) -> None:
        """Save the pictures beside a calibration file, named after it, such as calibration_ref5.png.

        Raises
        ------
        OutputError
            A picture cannot be written.
        """
        for name, picture in self.pictures.items():
            write_picture(path, name, picture)

    @property
    def px_per_mm(self) -> float:
        """The scale s in pixels per millimetre."""
        return self.scale.px_per_mm

    @property
    def u_px_per_mm(self) -> float:
        """Its standard uncertainty."""
        return self.scale.u_px_per_mm

    @property
    def edge_bias_px(self) -> float:
        """The edge bias b of a light gap between dark edges (pixels)."""
        return self.scale.edge_bias_px

    @property
    def u_edge_bias_px(self) -> float:
        """Its standard uncertainty."""
        return self.scale.u_edge_bias_px

    @property
    def frame_size_px(self) -> tuple[int, int]:
        """Width and height of the pictures for which the calibration is valid (pixels)."""
        return self.scale.frame_size_px

    @speaks_python
    def check(
        self, references: Any, *, u_size_mm: float = 0.001, roi: Sequence[int] | None = None
    ) -> tuple[Agreement, ...]:
        """Measure objects of known size and say whether each agrees with its stated size (E_n score of ISO 13528).

        Parameters
        ----------
        references : mapping of path to float, or sequence of (path or picture, float)
            Pictures with their sizes in mm, as for `fingervision.calibrate`.
        u_size_mm : float
            Standard uncertainty of every size.
        roi : (int, int, int, int) or None
            Use only this part of every picture.

        Returns
        -------
        tuple of calib.Agreement
            One result per picture, in order: `measured_mm`, `e_n`, `agrees`.

        Raises
        ------
        UsageError
            An item has an impossible value.
        DataError, InputFileError
            A picture cannot be read, or its size differs from that of the calibration.
        """
        from fingervision.interface.reference_pictures import known_sizes, references_of

        return self.check_sizes(known_sizes(references_of(references, "bar"), u_size_mm), region_of(roi))

    def check_sizes(
        self, pictures: Sequence[KnownSize], region: tuple[int, int, int, int] | None
    ) -> tuple[Agreement, ...]:
        """Check the calibration on pictures that were already read; see `check`."""
        from dataclasses import replace

        height, width = pictures[0].grey.shape
        self.scale.check_frame_size(width, height)
        read_with = PictureResponse.of_calibration(self.scale)
        light = [replace(picture, grey=read_with.light(picture.grey)) for picture in pictures]
        edges = find_widths(light, region, self.scale.px_per_mm)
        points = np.array([edge.points_px for edge in edges])
        u_random = np.array([edge.u_width_px for edge in edges])
        distances = self.scale.distances(points, u_random, np.array([edge.light for edge in edges]))
        assert distances.u_mm is not None  # noqa: S101 - a calibration always has an uncertainty
        return tuple(
            Agreement(float(value), float(u), picture.size_mm, picture.u_size_mm)
            for picture, value, u in zip(pictures, distances.value_mm, distances.u_mm, strict=True)
        )

    def report(self) -> str:
        """Return scale, edge bias, measured references and uncertainty budget as the command prints them."""
        return "\n".join([*scale_lines(self.scale), *self.lines, *budget_lines(self.scale)])

    def __repr__(self) -> str:
        width, height = self.frame_size_px
        return (
            f"Calibration({self.px_per_mm:.4f} px/mm, U = {2.0 * self.u_px_per_mm:.4f} px/mm (k = 2), edge bias "
            f"{self.edge_bias_px:+.4f} px, for {width}x{height} pixels)"
        )

    def _repr_html_(self) -> str:
        """HTML for a notebook: the report, and the edges found in the first picture."""
        from fingervision.interface.notebook import image_html, png_of

        first = next(iter(self.pictures.values()), None)
        return f"<pre>{escape(self.report())}</pre>{'' if first is None else image_html(png_of(first))}"


__all__ = ["Calibration"]
