"""`fingervision.diagnose`: name the effect that a model lacks, from a measured table."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.diagnose import Diagnosis as Found
from fingervision.diagnosis.diagnose import diagnose as diagnose_table
from fingervision.diagnosis.report.answer_files import corrected, write_answer
from fingervision.diagnosis.report.figure_files import residual_figure
from fingervision.diagnosis.report.paper_figure import WIDTHS_MM, paper_figure
from fingervision.diagnosis.report.report_page import SIMULATION, curves_of
from fingervision.diagnosis.report.residual_localization import by_channel
from fingervision.diagnosis.report.sentences import detail_lines
from fingervision.domain.effect import Effect
from fingervision.domain.errors import ArgumentError
from fingervision.domain.report import DiagnosisReport, NamedEffect, Verdict
from fingervision.interface.argument_checks import speaks_python, whole_number
from fingervision.interface.notebook import cell_html, save_results
from fingervision.interface.own_effect import added
from fingervision.interface.progress import shown
from fingervision.interface.tables import effect_names, followed_given, measured_given, model_given, own_base
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.out_folder import mark_owner, out_folder
from fingervision.storage.provenance import Provenance, provenance

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure


CALL = "fingervision.diagnose(...) in Python"


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """Result of a diagnosis with its residuals and the corrected model; made by `fingervision.diagnose`.

    Parameters
    ----------
    found : fingervision.diagnosis.diagnose.Diagnosis
        The report, and the arrays from which it was made.
    model : CorrectedModel
        The model that was diagnosed.
    measured : Path
        File of the table, or a name for a table in memory.
    made : Provenance
        Files with their hashes, versions and time.
    own_effects : tuple of Effect
        User-defined effects that were tried in addition to the catalogue in this call.
    """

    found: Found = field(repr=False)
    model: CorrectedModel
    measured: Path
    made: Provenance = field(repr=False)
    own_effects: tuple[Effect, ...] = ()

    @property
    def report(self) -> DiagnosisReport:
        """The result of the diagnosis, with the fields of report.json."""
        return self.found.report

    @property
    def verdict(self) -> Verdict:
        """The verdict: agrees, named, ambiguous (several explanations, `report.alternatives`) or unknown.

        Where it is unknown, `report.sentence` says why, and `report.next_step` what to record or to look at next.
        """
        return self.report.verdict

    @property
    def effects(self) -> tuple[NamedEffect, ...]:
        """The named effects with their parameters; those of the best explanation if the verdict is ambiguous."""
        return self.report.effects

    @property
    def residual_before_mm(self) -> Mapping[str, NDArray[np.float64]]:
        """Measured minus predicted by the given model (mm), by channel (gap, left, right, midline), each shape (n,)."""
        return by_channel(self.found.data, self.found.before_mm)

    @property
    def residual_after_mm(self) -> Mapping[str, NDArray[np.float64]]:
        """Measured minus predicted by the corrected model (mm), by channel, each of shape (n,)."""
        return by_channel(self.found.data, self.found.after_mm)

    @property
    def input_mm(self) -> NDArray[np.float64]:
        """Recorded input of each residual, shape (n,) (mm)."""
        return self.found.data.chain.history.input_mm

    @property
    def corrected_model(self) -> CorrectedModel:
        """The given model with the named effects added; every function that takes a model accepts it."""
        return corrected(self.found, self.model)

    def figure(self) -> "Figure":
        """Draw the residuals before and after the correction, as in residuals.svg."""
        after = self.residual_after_mm if self.effects else None
        return residual_figure(
            dict(self.residual_before_mm),
            None if after is None else dict(after),
            self.found.data.chain.history,
            self.found.left_out,
        )

    def sentences(self) -> str:
        """Return the result in the sentences that the command prints."""
        report = self.report
        lines = [f"{report.verdict}: {report.sentence}"]
        lines += [f"  {line}" for line in detail_lines(report.verdict, report.effects, report.alternatives)]
        lines += [f"  note: {words}" for words in (*report.outliers, *report.notes)]
        if report.next_run is not None or report.verdict is Verdict.UNKNOWN:
            lines.append(f"  next: {report.next_step}")
        return "\n".join(lines)

    def gap_figure(self, title: str = "", name: str = SIMULATION, *, width_mm: float = WIDTHS_MM[""]) -> "Figure":
        """Draw the gap against the input with the residuals under it, for a paper: 85 or 170 mm wide, 8 point text."""
        return paper_figure(curves_of(self.found, name), title, width_mm=width_mm, left_out=self.found.left_out)

    def save(self, folder: "str | os.PathLike[str]", title: str = "", name: str = SIMULATION) -> Path:
        """Write what `fingervision diagnose --out FOLDER` writes: report.html, report.json, model.toml, figures.

        Parameters
        ----------
        folder : path
            Folder for the results.
        title, name : str
            Title of the figures, and the model's name in their legends.

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
        return save_results(self.measured, folder, lambda out: self.write(out, title, name))

    def write(self, out: Path, title: str = "", name: str = "") -> dict[str, object]:
        """Write the files of the diagnosis into an existing folder, and return the content of report.json."""
        with out_folder(out), added(self.own_effects):
            base = own_base(self.model, out, self.found.data.chain.model)
            document = write_answer(out, self.found, base, self.made, self.measured, title, name or SIMULATION)
        mark_owner(out, self.measured)
        return document

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict}: {self.report.sentence})"

    def _repr_html_(self) -> str:
        return cell_html(self, self.sentences())


@speaks_python
def diagnose(
    measured: Any,
    model: Any,
    *,
    with_effects: Iterable[str] = (),
    without_effects: Iterable[str] = (),
    effects: Iterable[Effect] = (),
    seed: int = 1,
    kind: str = "lumped",
    columns: "str | os.PathLike[str] | None" = None,
    progress: Callable[[float], None] | bool | None = None,
    call: str = CALL,
) -> Diagnosis:
    """Name the effect that a model lacks, from a measured table; write nothing.

    Parameters
    ----------
    measured : path, Measurement, MeasuredTable, DataFrame or mapping of columns
        `input_mm,gap_mm[,run,time_s,left_mm,right_mm,u_random_mm,force_n]`; a measurement needs a drive.
    model : path, callable, CorrectedModel, Diagnosis, or a simulation as DataFrame or mapping of columns
        The model to be diagnosed. A callable takes times (s, from 0) and inputs (mm) of shape (n,), and returns the gap
        of shape (n,), or a mapping with `gap_mm` or `left_mm` and `right_mm`, and `force_n` if there is a force.
    with_effects, without_effects : iterable of str
        Effects that every explanation must include, or must not include.
    effects : iterable of Effect
        User-defined effects that are tried in addition to the catalogue in this call; see `fingervision.effect`.
    seed : int
        Seed of the bootstrap; the same seed gives the same report.
    kind : str
        Kind of model by which a gripper.toml is computed: stiffness_matrix, lumped or finite_element.
    columns : path or None
        A columns.toml, for tables of other programs.
    progress : callable, bool or None
        Function called with the completed share of the work, from 0 to 1; True shows a progress bar on a terminal or in
        a notebook.
    call : str
        Name of this call in the provenance of the results.

    Returns
    -------
    Diagnosis
        Report, residuals, corrected model, figures.

    Raises
    ------
    ArgumentError
        An argument has an impossible value; for an unknown effect, the message names the nearest known effect.
    FingervisionError
        Table or model cannot be read, or do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> import fingervision as fv
    >>> inputs = np.linspace(0.0, 1.0, 60)
    >>> gaps = 1.02 + 2.0 * inputs + np.random.default_rng(1).normal(0.0, 0.001, 60)
    >>> simulation = {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}
    >>> found = fv.diagnose({"input_mm": inputs, "gap_mm": gaps}, simulation)
    >>> print(found.verdict, found.effects[0].name in found.report.alternatives[0])
    ambiguous True
    """
    own = tuple(effects)
    for each in own:
        if not isinstance(each, Effect):
            raise ArgumentError("effects", "be effects made by fingervision.effect", f"holds {each!r}")
    seed = whole_number("seed", seed, 0)
    with added(own):
        forced, without = effect_names("with_effects", with_effects), effect_names("without_effects", without_effects)
        if forced & without:
            both = ", ".join(sorted(forced & without))
            raise ArgumentError(
                "with_effects", "not hold an effect that without_effects excludes", f"{both} is in both"
            )
        followed = followed_given(measured, model)
        table, given = measured_given(measured, columns, followed), model_given(model, kind, columns, followed)
        made = provenance({**table.files("measured table", columns), **given.files("model", columns)}, call)
        with shown(progress, "Diagnosing") as show:
            told: dict[str, Any] = {} if show is None else {"progress": show}
            found = diagnose_table(table.value, given.value, seed=seed, forced=forced, without=without, **told)
    return Diagnosis(found, given.value, table.path, made, own)
