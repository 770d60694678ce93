"""Inputs at which the `model` command computes results: those of a drive table, or the published range."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import ModelFigures
from fingervision.tables.read import read_drive

_METRES_BELOW_OF_HEIGHT = 1e-4
_ROWS_BETWEEN = 61
"""Number of inputs over the range of a drive; the error of linear interpolation between them is below 1 µm for the
sample gripper."""
_MOST_ROWS = 401


def inputs_mm(drive: Path, columns: Path | None, gripper: Gripper) -> NDArray[np.float64]:
    """Read the distinct inputs of a drive table, and refuse inputs in another unit than mm."""
    inputs = np.unique(read_drive(drive, columns).input_mm)
    largest = float(np.abs(inputs).max())
    if 0.0 < largest < _METRES_BELOW_OF_HEIGHT * gripper.body.height_mm:
        raise UsageError(
            f"The inputs of {drive} must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they metres? Multiply the column input_mm by 1000."
        )
    if largest > gripper.body.height_mm:
        raise UsageError(
            f"The inputs of {drive} must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they micrometres? Divide the column input_mm by 1000."
        )
    if inputs.size < 2:
        raise UsageError(f"The drive {drive} must hold at least two different inputs, but holds {inputs.size}.")
    return inputs if inputs.size <= _MOST_ROWS else np.linspace(inputs[0], inputs[-1], _MOST_ROWS)


def with_rows_between(inputs: NDArray[np.float64], figures: ModelFigures) -> NDArray[np.float64]:
    """Add inputs between those of a drive table and at the first touch: a table is linear between its rows."""
    low, high = float(inputs.min()), float(inputs.max())
    touch = figures.contact_input_mm
    bends = [touch] if touch is not None and low < touch < high else []
    return np.union1d(inputs, np.concatenate([np.linspace(low, high, _ROWS_BETWEEN), bends]))


def inputs_until_touch(figures: ModelFigures) -> NDArray[np.float64]:
    """Inputs (mm) from the first touch (closing) to three times this amount in opening: the published range."""
    touch = figures.contact_input_mm or -0.1
    return np.union1d(np.linspace(touch, 0.0, 26), np.linspace(0.0, -3.0 * touch, 76))
