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
from fingervision.interface.argument_checks import path_of, region_of, speaks_python
from fingervision.measuring.picture_response import PictureResponse
from fingervision.measuring.scale import field_of_view
from fingervision.storage.calibration_json import read_calibration, refuse_foreign, write_calibration, write_picture

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from calib.line_scale import ScaleLines
    from calib.parallel_edges import ParallelEdges
    from calib.scale_from_board import BoardFit
    from calib.scale_from_lines import LineScaleFit
    from calib.scale_from_sizes import ScaleFit


# The report of a calibration, in lines of text.


# The budget is printed for a gap of this size in the middle of the picture, measured over 20 rows.
TABLE_GAP_MM, TABLE_U_PX = 1.0, 0.0106


def scale_lines(calibration: MeasuredScale) -> list[str]:
    """Lines with the scale, what the picture shows at it, and the edge bias, with their expanded uncertainties."""
    scale, u = calibration.px_per_mm, calibration.u_px_per_mm
    width, height = calibration.frame_size_px
    return [
        f"scale      {scale:.7g} px/mm   U = {2 * u:.2g} px/mm (k = 2), {200 * u / scale:.2g} %",
        f"picture    {width} x {height} px show {field_of_view((width, height), scale)}",
        f"edge bias  {calibration.edge_bias_px:+.4f} px       U = {2 * calibration.u_edge_bias_px:.4f} px (k = 2)",
    ]


def budget_lines(calibration: MeasuredScale) -> list[str]:
    """Lines of the uncertainty budget of a gap, the largest contribution first."""
    width, height = calibration.frame_size_px
    half = TABLE_GAP_MM * calibration.px_per_mm / 2.0
    x, y = (width - 1) / 2.0, (height - 1) / 2.0
    points = np.array([[[x - half, y], [x + half, y]]])
    table = calibration.budget(points, np.array([TABLE_U_PX]), np.array([True])).table()
    return [
        "",
        f"Budget of a light gap of {TABLE_GAP_MM:g} mm in the middle of the picture (standard uncertainties):",
        *table.splitlines(),
        "Not included: motion blur, a change of focus, aperture or exposure since the calibration, edges that are not",
        "the gripper's outline (dirt, burrs, reflections). Limits marked default were not stated: see --help.",
    ]


def sizes_lines(fit: "ScaleFit", edges: Sequence["ParallelEdges"]) -> list[str]:
    """Lines with every reference's size and its residual from the fitted straight line."""
    lines = [
        "",
        "reference            size, mm   width, px    u, px    rows used            taper, px/row       residual, um",
    ]
    for reference, edge, residual in zip(fit.calibration.references, edges, fit.residual_mm, strict=True):
        rows = f"{edge.profiles} {edge.first}-{edge.last} ({edge.count})"
        taper = f"{edge.taper:+.5f}+-{edge.u_taper:.5f}"
        lines.append(
            f"{reference.what:<20} {reference.size_mm:8.4f} {edge.width_px:11.4f} {edge.u_width_px:8.4f}    {rows:<20} "
            f"{taper:<19} {1e3 * residual:+8.3f}"
        )
    if not fit.bias_known:
        lines.append(
            "The sizes do not determine the edge bias, which is therefore taken as 0; its limit is included in the "
            "budget. Three sizes, or a bar and a slot, determine the edge bias."
        )
    elif fit.freedom == 0:
        lines.append("With two sizes the straight line cannot be checked; a third size checks it.")
    else:
        lines.append(
            f"Linearity: largest residual {1e3 * float(np.max(np.abs(fit.residual_mm))):.3f} um; chi square "
            f"{fit.chi_square:.2f} with {fit.freedom} degrees of freedom (chance {100 * fit.probability:.1f} %)."
        )
    if any(part.source.startswith("misfit") for part in fit.calibration.parts):
        lines.append(
            "The sizes do not lie on a straight line within their uncertainties, which were enlarged to match. "
            "Check the certificates, remove dirt, and make sure that nothing moved."
        )
    for reference, edge in zip(fit.calibration.references, edges, strict=True):
        if abs(edge.taper) > 3.0 * edge.u_taper and abs(edge.taper) * edge.count > 0.05:
            lines.append(
                f"{reference.what} tapers by {edge.taper:+.4f} px per {edge.profiles[:-1]}: its width depends on the "
                f"{edge.profiles} used; choose with --roi those for which the certificate is valid."
            )
    return lines


def board_lines(fit: "BoardFit") -> list[str]:
    """Lines about the lens, the plane, and how straight the board's rows are."""
    lines = [""]
    if fit.lens is None:
        lines.append("lens       not calibrated: one picture determines only the plane")
    else:
        names = ("f_x px", "f_y px", "c_x px", "c_y px", "k1", "k2", "p1", "p2", "k3")
        values = zip(names, fit.lens.lens.parameters, fit.lens.u_parameters, strict=True)
        lines.append("lens       " + ", ".join(f"{name} {value:.5g}+-{u:.1g}" for name, value, u in values))
        lines.append(f"corners    {fit.lens.rms_px:.4f} px RMS over all pictures (reprojection)")
    lines.append(f"plane      {fit.calibration.references[0].what}: tilted by {fit.plane.tilt_deg:.2f} degrees")
    lines.append(f"straight   rows and columns of corners to {fit.straightness_px:.4f} px RMS after correction")
    lines.append(
        "The calibration is valid in the plane of the first picture: in that picture, the board must lie where the "
        "gripper moves."
    )
    return lines


def as_json(calibration: MeasuredScale, more: dict[str, Any]) -> dict[str, Any]:
    """Summary of a calibration as a dictionary, for programs."""
    return {
        "px_per_mm": calibration.px_per_mm,
        "u_px_per_mm": calibration.u_px_per_mm,
        "edge_bias_px": calibration.edge_bias_px,
        "u_edge_bias_px": calibration.u_edge_bias_px,
    } | more


def line_details(fit: "LineScaleFit", lines: "ScaleLines") -> dict[str, object]:
    """Results for a line scale as a dictionary, for programs."""
    return {
        "bias_known": False,
        "lines": len(lines.at_px),
        "lines_used": int(fit.used.sum()),
        "dark": lines.is_dark,
        "line_width_mm": fit.width_mm,
        "u_line_width_mm": fit.u_width_mm,
        "px_per_mm_by_rising_edges": fit.by_edge[0],
        "px_per_mm_by_falling_edges": fit.by_edge[1],
        "largest_residual_um": float(abs(fit.residual_um[fit.used]).max()),
        "chi_square": fit.chi_square,
        "freedom": fit.freedom,
    }


def line_lines(fit: "LineScaleFit", lines: "ScaleLines") -> list[str]:
    """Lines of text about the lines of a line scale, their edges and their residuals."""
    rising, falling = fit.by_edge
    scale = fit.calibration.px_per_mm
    tone = "dark" if lines.is_dark else "light"
    text = [
        "",
        f"lines      {int(fit.used.sum())} of {len(lines.at_px)} {tone} lines used, over "
        f"{fit.calibration.references[0].size_mm:g} mm; edges spread over {lines.blur_px:.2f} px (sigma)",
        f"edges      scale by rising edges alone {100 * (rising / scale - 1):+.4f} %, by falling edges alone "
        f"{100 * (falling / scale - 1):+.4f} %, relative to that by the middles of the lines",
        f"residuals  {float(abs(fit.residual_um[fit.used]).max()):.3f} um at most; chi square {fit.chi_square:.1f} "
        f"with {fit.freedom} degrees of freedom (chance {100 * fit.probability:.1f} %)",
    ]
    if fit.width_mm is not None:
        text.insert(
            3, f"width      {1e3 * fit.width_mm:.2f} um, the apparent width of the lines (not corrected for edge bias)"
        )
    else:
        text.insert(3, "width      not determined: the lines are narrower than twice their blur")
    if fit.probability < 0.01:
        text.append(
            "The distances of the lines are not equal within their uncertainties, which were enlarged to match."
        )
    if lines.is_clipped:
        text.append("Part of the picture is clipped at an end of the grey scale: the widths of the lines may be wrong.")
    return text


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
            f"Calibration({self.px_per_mm:.6g} px/mm, U = {2.0 * self.u_px_per_mm:.2g} px/mm (k = 2), edge bias "
            f"{self.edge_bias_px:+.4f} px, for {width}x{height} pixels)"
        )

    def _repr_html_(self) -> str:
        """HTML for a notebook: the report, and the edges found in the first picture."""
        from fingervision.interface.notebook import image_html, png_of

        first = next(iter(self.pictures.values()), None)
        return f"<pre>{escape(self.report())}</pre>{'' if first is None else image_html(png_of(first))}"
