"""Which channel stands for the gap, where a measured table or a model has none: the one that moves most."""

from pathlib import Path

import numpy as np

from fingervision.models.mechanism_bodies import bodies_of, column_name
from fingervision.models.physical_gripper import GAP
from fingervision.storage.csv_columns import header_of, read_columns
from fingervision.storage.measured_table import FEWEST_ROWS, NUMBERS, channel_names
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism
from fingervision.storage.model_toml import FOLLOWED
from fingervision.storage.toml_section import read_section
from fingervision.tables.read import TABLE_ENDINGS

INPUT, GAP_COLUMN, SIDES = "input_mm", "gap_mm", ("left_mm", "right_mm")


def followed_channel(measured: Path, model: Path) -> str:
    """Choose the coordinate of a body that is compared in place of the gap.

    Of all displacements that the table holds and the model predicts, it is the one with the largest range.

    Parameters
    ----------
    measured, model : Path
        A measured table in fingervision's own format, and a mechanism.toml, a simulation table or a corrected model.

    Returns
    -------
    str
        Name of the column; empty if both have a gap, or if they have no displacement of a body in common.
    """
    names = header_of(measured)
    moving = [name for name in channel_names(names, NUMBERS) if name.endswith("_mm") and not name.startswith("u_")]
    if INPUT not in names or not moving:
        return ""
    predicted = _predicted(model)
    common = [name for name in moving if name in predicted]
    gaps = [name for name in (GAP_COLUMN, *SIDES) if name in names]
    table = read_columns(measured, (INPUT,), (*common, *gaps))
    has_gap = any(np.count_nonzero(table.numbers(name).present) >= FEWEST_ROWS for name in gaps)
    if (has_gap and GAP_COLUMN in predicted) or not common:
        return ""
    columns = {name: table.numbers(name) for name in common}
    ranges = {name: np.ptp(each.value[each.present]) for name, each in columns.items() if each.present.any()}
    return max(ranges, key=lambda name: float(ranges[name]), default="")


def _predicted(model: Path) -> set[str]:
    """Names of the displacements, or of the gap, that a model predicts."""
    if model.suffix.lower() != ".toml":
        return set(header_of(model)) if model.suffix.lower() in TABLE_ENDINGS else set()
    if not is_mechanism(model):
        return {str(read_section(model, "model").values.get(FOLLOWED, GAP_COLUMN))}
    mechanism = read_mechanism(model)
    bodies = {f"{column_name(body.name)}.{part}_mm" for body in bodies_of(mechanism) for part in "xy"}
    return bodies | ({GAP_COLUMN} if GAP in mechanism.pairs else set())
