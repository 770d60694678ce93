"""Camera response with which pictures of a reference are read, and the scale that follows from them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from calib.camera_response import CameraResponse, standard_response
from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from calib.measured_scale import Calibration
from calib.parallel_edges import ParallelEdges, measure_parallel_edges
from calib.scale_from_sizes import MeasuredSize
from fingervision.domain.errors import DataError
from fingervision.frames.transfer_tag import transfer_tag
from fingervision.storage.response_csv import response_named
from fingervision.vision.grey import GreyImage, top_level


@dataclass(frozen=True, slots=True)
class PictureResponse:
    """The response (grey level against light) with which pictures are read.

    Parameters
    ----------
    response, other : CameraResponse
        The response that is used, and the alternative standard response.
    is_known : bool
        Whether the user stated it.
    """

    response: CameraResponse
    other: CameraResponse
    is_known: bool

    @classmethod
    def of(cls, words: str, files: Sequence[Path]) -> Self:
        """Choose the response by the option --response.

        `auto` takes the tag of the pictures, or a linear response if they have none. A picture without a tag, such as
        a frame saved as PNG, may be of the same camera as one with a tag.

        Raises
        ------
        DataError
            The tags of two pictures differ.
        """
        stated = response_named(words)
        tags = {tag: file for file in files if stated is None and (tag := transfer_tag((file,))) is not None}
        if len(tags) > 1:
            found = " and ".join(f"{tag} in {file.name}" for tag, file in tags.items())
            raise DataError(
                f"All pictures must state the same camera response, but they state {found}: take them with the same "
                "settings, or give the response with --response."
            )
        response = stated or standard_response(next(iter(tags), "linear"))
        other = standard_response("srgb" if response.name == "linear" else "linear")
        return cls(response, other, stated is not None)

    @classmethod
    def of_calibration(cls, calibration: Calibration) -> Self:
        """Use the response with which a calibration was made."""
        response = calibration.camera_response or standard_response("linear")
        return cls(response, response, calibration.response_known)

    def light(self, grey: GreyImage) -> GreyImage:
        """Convert a picture to light; a linear response leaves the levels unchanged."""
        return _light(self.response, grey)

    def shift_px(self, stored: Sequence[KnownSize], edges: Sequence[ParallelEdges]) -> float:
        """Mean width (px) by which a light gap appears wider with this response than with the alternative response."""
        shifts = []
        for picture, edge in zip(stored, edges, strict=True):
            levels = _light(self.other, picture.grey).astype(float)
            try:
                ends = (edge.edges_px[0][[0, -1]], edge.edges_px[1][[0, -1]])
                again = measure_parallel_edges(levels, ends, edge.light)
            except CalibrationError:
                continue
            shifts.append((edge.width_px - again.width_px) * (1.0 if edge.light else -1.0))
        return sum(shifts) / len(shifts) if shifts else 0.0

    def noted(self, calibration: Calibration, shift_px: float) -> Calibration:
        """Store in a calibration the response with which its pictures were read."""
        return replace(
            calibration,
            camera_response=self.response,
            response_known=self.is_known,
            response_shift_px=shift_px,
        )


def read_sizes(
    stored: Sequence[KnownSize],
    region: tuple[int, int, int, int] | None,
    read_with: PictureResponse,
    certificate: str = "",
    date: str = "",
) -> tuple[list[ParallelEdges], list[MeasuredSize], float]:
    """Measure objects of known size in their pictures.

    Parameters
    ----------
    stored : sequence of KnownSize
        The pictures, as stored.
    region : tuple of int or None
        x, y, width and height of the part of every picture to be searched.
    read_with : PictureResponse
        The camera response.
    certificate, date : str
        Name and date of the certificate of the sizes.

    Returns
    -------
    edges : list of ParallelEdges
        Edges in every picture.
    sizes : list of MeasuredSize
        Certified and measured sizes.
    shift_px : float
        Mean width by which a light gap appears wider with this response than with the alternative response.
    """
    edges = find_widths([replace(picture, grey=read_with.light(picture.grey)) for picture in stored], region)
    sizes = [MeasuredSize.of(picture, edge, certificate, date) for picture, edge in zip(stored, edges, strict=True)]
    return edges, sizes, read_with.shift_px(stored, edges)


def _light(response: CameraResponse, grey: GreyImage) -> GreyImage:
    if response.name == "linear":
        return grey
    return response.linearised(grey, response.top_level or top_level(grey))
