"""Convert measurements in pixels to rows of the table, many frames at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.frame import LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.measuring.gap_budget import bias_shares, gap_budget
from fingervision.measuring.scale import Scale
from fingervision.motion.drive_at import drive_at
from fingervision.storage.gaps_csv import GapRow


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one frame.

    Parameters
    ----------
    index : int
        Number of the frame in the recording.
    time_s : float or None
        Presentation time.
    outcome : GapMeasurement, NoGap or LostFrame
        The measured gap, or the reason why there is none.
    """

    index: int
    time_s: float | None
    outcome: GapMeasurement | NoGap | LostFrame


@dataclass(frozen=True, slots=True)
class RowMaker:
    """Converts results to rows of gaps.csv.

    Parameters
    ----------
    scale : Scale
        Conversion from pixels to millimetres.
    frame_size_px : (int, int)
        Width and height of the frames.
    drive : DriveHistory or None
        The recorded input.
    drive_offset_s : float
        Offset that is added to the drive's times to give times of the recording.
    """

    scale: Scale
    frame_size_px: tuple[int, int]
    drive: DriveHistory | None = None
    drive_offset_s: float = 0.0

    def rows(self, results: Sequence[Result]) -> list[GapRow]:
        """Rows in the order of the results; the scale converts all of them in one call."""
        measured = [result.outcome for result in results if isinstance(result.outcome, GapMeasurement)]
        millimetres = iter(self._millimetres(measured))
        return [
            self._row(result, next(millimetres) if isinstance(result.outcome, GapMeasurement) else None)
            for result in results
        ]

    def _millimetres(self, measured: Sequence[GapMeasurement]) -> list[tuple[float, float | None, float, float, float]]:
        """Gap, standard uncertainty, its random part, left and right position (all in mm), for each measurement."""
        if not measured:
            return []
        points = np.array([((m.left.x_px, m.left.y_px), (m.right.x_px, m.right.y_px)) for m in measured], dtype=float)
        u_random_px = np.array([m.u_gap_px for m in measured], dtype=float)
        light_gap = np.array([m.light_gap for m in measured], dtype=bool)
        vertical = np.array([m.direction.is_vertical for m in measured], dtype=bool)
        shares = bias_shares(measured)
        distances = self.scale.distances(points, u_random_px, light_gap, shares)
        across = np.empty((len(measured), 2))
        for axis, chosen in ((0, vertical), (1, ~vertical)):
            if chosen.any():
                across[chosen] = self.scale.positions_mm(
                    points[chosen], axis, light_gap[chosen], self.frame_size_px, shares[chosen]
                )
        u_mm: list[float | None] = [None] * len(measured)
        if distances.u_mm is not None:
            u_mm = gap_budget(measured, self.scale).u_mm.tolist()
        return list(
            zip(
                distances.value_mm.tolist(),
                u_mm,
                distances.u_random_mm.tolist(),
                across[:, 0].tolist(),
                across[:, 1].tolist(),
                strict=True,
            )
        )

    def _row(self, result: Result, millimetres: tuple[float, float | None, float, float, float] | None) -> GapRow:
        run, input_mm, force_n = "", None, None
        if self.drive is not None and result.time_s is not None:
            state = drive_at(self.drive, result.time_s - self.drive_offset_s)
            if state is not None:
                run, input_mm, force_n = state.run, state.input_mm, state.force_n
        outcome = result.outcome
        if not isinstance(outcome, GapMeasurement) or millimetres is None:
            held_px, held_mm = self._held(outcome)
            return GapRow(
                result.index,
                result.time_s,
                outcome.status,
                held_px=held_px,
                held_mm=held_mm,
                run=run,
                input_mm=input_mm,
                force_n=force_n,
            )
        gap_mm, u_gap_mm, u_random_mm, left_mm, right_mm = millimetres
        held_px, held_mm = self._held(outcome)
        return GapRow(
            frame=result.index,
            time_s=result.time_s,
            status=outcome.status,
            gap_mm=gap_mm,
            u_gap_mm=u_gap_mm,
            u_random_mm=u_random_mm,
            gap_px=outcome.gap_px,
            u_gap_px=outcome.u_gap_px,
            left_x_px=outcome.left.x_px,
            left_y_px=outcome.left.y_px,
            right_x_px=outcome.right.x_px,
            right_y_px=outcome.right.y_px,
            left_tip_px=outcome.left.tip_px,
            right_tip_px=outcome.right.tip_px,
            left_mm=left_mm,
            right_mm=right_mm,
            u_shift_px=outcome.u_picture_px,
            fingers="dark" if outcome.light_gap else "light",
            held_px=held_px,
            held_mm=held_mm,
            run=run,
            input_mm=input_mm,
            force_n=force_n,
        )

    def _held(self, outcome: GapMeasurement | NoGap | LostFrame) -> tuple[float | None, float | None]:
        """Width of a held part and its uncertainty; between dark fingers, its edges are those of the gap."""
        held = None if isinstance(outcome, LostFrame) else outcome.held
        if held is None:
            return None, None
        points = np.array([[(held.left_x_px, held.left_y_px), (held.right_x_px, held.right_y_px)]])
        found = self.scale.distances(points, np.array([held.u_width_px]), np.array([held.light_gap]))
        return held.width_px, float(found.value_mm[0])
