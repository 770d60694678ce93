"""Scale, plane and lens calibration from pictures of a board."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.board import Board, BoardCorners
from calib.errors import CalibrationError
from calib.lens_from_boards import LensFit, lens_from_boards, straightness_px
from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.plane_from_board import PlaneFit, plane_from_board

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class BoardFit:
    """The calibration, with the residuals of its fit.

    Parameters
    ----------
    calibration : Calibration
        The result.
    lens : LensFit or None
        Lens fit; None for one picture, which determines the plane only.
    plane : PlaneFit
        Plane of the first picture.
    straightness_px : float
        Root-mean-square distance of all corners from straight rows and columns, corrected for the lens.
    """

    calibration: Calibration
    lens: LensFit | None
    plane: PlaneFit
    straightness_px: float


def scale_from_board(
    pictures: Sequence[BoardCorners],
    board: Board,
    frame_size_px: tuple[int, int],
    limits: Limits,
    stated: frozenset[str] = frozenset(),
) -> BoardFit:
    """Calibrate on a board; distances are measured in the plane of the board in the first picture.

    Parameters
    ----------
    pictures : sequence of BoardCorners
        One picture for the plane; three or more, at different tilts, for the lens as well.
    board : Board
        The board in the pictures.
    frame_size_px : tuple of int
        Width and height.
    limits, stated
        Limits of the set-up's imperfections, and the names of those that the user stated.
    """
    if not pictures:
        raise CalibrationError("A calibration needs at least one picture of the board, but there is none.")
    lens = lens_from_boards(pictures, frame_size_px) if len(pictures) > 1 else None
    first = pictures[0]
    ideal_px = first.points_px if lens is None else lens.lens.undistort(first.points_px)
    plane = plane_from_board(first, ideal_px, frame_size_px)
    relative = board.u_square_mm / board.square_mm
    parts = (
        _part("reference size", plane.px_per_mm * relative, 0.0, "the certificate (--u-square-mm)"),
        _part("reference edges", plane.u_px_per_mm, 0.0, "the fit of the first picture's corners"),
        _part(
            "edge bias",
            0.0,
            rectangular(limits.edge_bias_px),
            f"+-{limits.edge_bias_px:g} px ({'stated' if 'edge_bias_px' in stated else 'default'}); corners do not "
            "determine the edge bias",
        ),
    )
    kind = "chessboard" if board.marker_mm is None else "ChArUco board"
    calibration = Calibration(
        px_per_mm=plane.px_per_mm,
        edge_bias_px=0.0,
        parts=parts,
        frame_size_px=frame_size_px,
        limits=limits,
        stated=stated,
        response=Response(lens=np.array([plane.by_lens, 0.0])),
        lens=None if lens is None else lens.lens,
        plane=plane.plane,
        references=tuple(
            Reference(f"{kind} {board.columns}x{board.rows}, {each.name}", board.square_mm, board.u_square_mm)
            for each in pictures
        ),
    )
    away = np.concatenate([straightness_px(each, calibration.lens) for each in pictures])
    return BoardFit(calibration, lens, plane, float(np.sqrt(np.mean(away**2))) if away.size else 0.0)


def _part(source: str, u_scale: float, u_bias: float, supplied: str) -> ScalePart:
    return ScalePart(source, np.diag([u_scale**2, u_bias**2]), supplied)
