"""`fingervision.compare`: where a measured table and a model disagree beyond the noise."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.compare import Comparison as OneComparison
from fingervision.diagnosis.compare import compare as compare_one
from fingervision.diagnosis.report.comparison_files import (
    comparison_document,
    curves_of,
    left_out_of,
    residuals_of,
    write_comparison,
)
from fingervision.diagnosis.report.paper_figure import WIDTHS_MM, paper_figure
from fingervision.domain.report import Place
from fingervision.interface.argument_checks import speaks_python, whole_number
from fingervision.interface.notebook import cell_html, save_results
from fingervision.interface.tables import followed_given, measured_given, models_given
from fingervision.storage.out_folder import mark_owner, out_folder
from fingervision.storage.provenance import Provenance, provenance

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure

CALL = "fingervision.compare(...) in Python"


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Result of `fingervision.compare`: where a measurement and one or more models disagree.

    Iterating over the object gives the names of the models; indexing by a name gives the result for that model. The
    properties below describe the first model.

    Parameters
    ----------
    models : mapping of str to fingervision.diagnosis.compare.Comparison
        Result for each model, by the name of the model.
    measured : Path
        File of the table, or a name for a table in memory.
    made : Provenance
        Files with their hashes, versions and time.
    """

    models: Mapping[str, OneComparison]
    measured: Path
    made: Provenance = field(repr=False)

    def __len__(self) -> int:
        return len(self.models)

    def __iter__(self) -> Iterator[str]:
        return iter(self.models)

    def __getitem__(self, model: str) -> OneComparison:
        return self.models[model]

    @property
    def first(self) -> OneComparison:
        """The comparison with the first model."""
        return next(iter(self.models.values()))

    @property
    def rms_mm(self) -> float:
        """Disagreement, RMS."""
        return self.first.rms_mm

    @property
    def noise_mm(self) -> float:
        """Standard deviation of the random noise of one gap reading (mm)."""
        return self.first.noise_mm

    @property
    def places(self) -> tuple[Place, ...]:
        """Regions in which the residual is significantly larger than the noise, the largest residual first."""
        return self.first.places

    @property
    def residual_mm(self) -> Mapping[str, NDArray[np.float64]]:
        """Measured minus predicted values, by channel (gap, left, right, midline), each of shape (n,) (mm)."""
        return self.first.residual_mm

    @property
    def input_mm(self) -> NDArray[np.float64]:
        """Recorded input of each residual, shape (n,) (mm)."""
        return self.first.data.chain.history.input_mm

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on table and model, in sentences."""
        return (*self.first.data.notes, *self.first.data.refitted())

    def document(self) -> dict[str, object]:
        """Return the content of compare.json."""
        return comparison_document(self.models, self.made)

    def report(self) -> str:
        """Return the result as the command `compare` prints it."""
        lines = []
        for name, found in self.models.items():
            which = "" if len(self.models) == 1 else f"{name}: "
            lines.append(f"{which}{found.words()}")
            lines += [f"  {place.words}" for place in found.places] or [
                "  model and measurement nowhere differ by more than the noise"
            ]
            lines += [f"  note: {words}" for words in (*found.data.notes, *found.data.refitted())]
        return "\n".join(lines)

    def figure(self) -> "Figure":
        """Draw the residuals of all models, as in compare.png."""
        return residuals_of(self.models)

    def gap_figure(self, title: str = "", *, width_mm: float = WIDTHS_MM[""]) -> "Figure":
        """Draw the gap against the input with the residuals under it, for a paper: 85 or 170 mm wide, 8 point text."""
        return paper_figure(curves_of(self.models), title, width_mm=width_mm, left_out=left_out_of(self.models))

    def save(self, folder: "str | os.PathLike[str]", title: str = "") -> Path:
        """Write what `fingervision compare --out FOLDER` writes: compare.html, compare.json and the figures.

        Parameters
        ----------
        folder : path
            Folder for the results.
        title : str
            Title of page and figures.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        UsageError
            The folder holds the results of another table.
        OutputError
            The folder or a file in it cannot be written.
        """
        return save_results(self.measured, folder, lambda out: self.write(out, title))

    def write(self, out: Path, title: str = "") -> None:
        """Write the files of the comparison into an existing folder, overwriting earlier ones."""
        with out_folder(out):
            write_comparison(out, self.models, self.made, self.measured, title)
        mark_owner(out, self.measured)

    def __repr__(self) -> str:
        words = (
            f"{name}: {found.rms_mm:.3g} mm RMS, noise {found.noise_mm:.2g} mm, {len(found.places)} places with a "
            f"larger difference"
            for name, found in self.models.items()
        )
        return f"Comparison({'; '.join(words)})"

    def _repr_html_(self) -> str:
        return cell_html(self, self.report())


@speaks_python
def compare(
    measured: Any,
    model: Any,
    *,
    seed: int = 1,
    kind: str = "lumped",
    columns: "str | os.PathLike[str] | None" = None,
    call: str = CALL,
) -> Comparison:
    """Say where a measured table and one or more models disagree beyond the noise; write nothing.

    Parameters
    ----------
    measured : path, Measurement, MeasuredTable, DataFrame or mapping of columns
        `input_mm,gap_mm[,run,time_s,left_mm,right_mm,u_random_mm,force_n]`; a measurement needs a drive.
    model : path, CorrectedModel, Diagnosis, or a simulation as DataFrame or mapping of columns
        The model; or a list of models, or a mapping of names to models.
    seed : int
        Seed of the bootstrap for the threshold.
    kind : str
        Kind of model by which a gripper.toml is computed: stiffness_matrix, lumped or finite_element.
    columns : path or None
        A columns.toml, for tables of other programs.
    call : str
        Name of this call in the provenance of the results.

    Returns
    -------
    Comparison
        Places, residuals and figures.

    Raises
    ------
    ArgumentError
        An argument has an impossible value.
    FingervisionError
        Table or model cannot be read, or do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> import fingervision as fv
    >>> inputs = np.linspace(0.0, 1.0, 60)
    >>> gaps = 1.0 + 2.0 * inputs + np.random.default_rng(1).normal(0.0, 0.001, 60)
    >>> simulation = {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}
    >>> found = fv.compare({"input_mm": inputs, "gap_mm": gaps}, simulation)
    >>> found.places
    ()
    """
    seed = whole_number("seed", seed, 0)
    followed = followed_given(measured, model)
    table = measured_given(measured, columns, followed)
    models = models_given(model, kind, columns, followed)
    files = table.files("measured table", columns)
    for name, given in models.items():
        files |= given.files(f"model {name}", columns)
    made = provenance(files, call)
    found = {name: compare_one(table.value, given.value, seed=seed) for name, given in models.items()}
    return Comparison(found, table.path, made)
