"""A measured table and its model as files, as a user gives them to a diagnosis."""

from collections.abc import Iterable
from pathlib import Path

from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model


def written(folder: Path, header: str, rows: Iterable[str], model: str) -> tuple[MeasuredTable, CorrectedModel]:
    """Write lines below a header to measured.csv, and rows of input and gap to sim.csv; read both."""
    (folder / "measured.csv").write_text("\n".join([header, *rows]) + "\n")
    (folder / "sim.csv").write_text(f"input_mm,gap_mm\n{model}\n")
    return read_measured_table(folder / "measured.csv"), read_model(folder / "sim.csv")
