"""Compare a recording with a healthy recording of the same specimen, and write what changed."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.diagnosis.bodies.reference_report import Compared, compare_with_healthy, drawing_svg
from fingervision.interface.argument_checks import speaks_python
from fingervision.interface.tables import measured_given, model_given
from fingervision.storage.bodies_csv import flexures_beside
from fingervision.storage.out_folder import mark_owner, out_folder
from fingervision.storage.provenance import Provenance, provenance

CALL = "fingervision.changes_since(...) in Python"
CHANGES, DRAWING = "changes.json", "changes.svg"


@dataclass(frozen=True, eq=False, repr=False)
class Changes:
    """What changed since a healthy recording; made by `changes_since`.

    Parameters
    ----------
    compared : Compared
        Result of the comparison.
    measured : Path
        Table of the faulty recording.
    made : Provenance
        Files with their hashes, versions and time.
    """

    compared: Compared
    measured: Path
    made: Provenance = field(repr=False)

    def sentences(self) -> str:
        """Return the result in the sentences that the command prints."""
        return "\n".join(self.compared.sentences())

    def __repr__(self) -> str:
        return f"Changes({self.sentences()})"

    def write(self, out: Path) -> dict[str, Any]:
        """Write changes.json and changes.svg into an existing folder, and return the content of changes.json."""
        document = {**self.compared.document(), "made": self.made.document()}
        with out_folder(out):
            (out / CHANGES).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
            drawing = drawing_svg(self.compared)
            if drawing:
                (out / DRAWING).write_text(drawing, encoding="utf-8")
        mark_owner(out, self.measured)
        return document


@speaks_python
def changes_since(
    faulty: Any, healthy: Any, model: Any, *, kind: str = "lumped", columns: Path | None = None, call: str = CALL
) -> Changes:
    """Compare a measured table with a healthy one of the same specimen; write nothing.

    Parameters
    ----------
    faulty, healthy : path, Measurement, MeasuredTable, DataFrame or mapping of columns
        Measured tables; the flexures.csv beside each file is used where both have one.
    model : path, or another model as in `fingervision.diagnose`
        The model; with a drawing, the place of a change is told.
    kind : str
        Kind of model by which a gripper.toml is computed.
    columns : Path or None
        A columns.toml, for tables of other programs.
    call : str
        Name of this call in the provenance of the results.

    Raises
    ------
    FingervisionError
        Tables or model cannot be read, or have too few rows.

    Examples
    --------
    >>> import numpy as np
    >>> import fingervision as fv
    >>> inputs = np.linspace(0.0, 1.0, 60)
    >>> gaps = 1.0 + 2.0 * inputs + np.random.default_rng(1).normal(0.0, 0.001, (2, 60))
    >>> healthy, faulty = ({"input_mm": inputs, "gap_mm": each} for each in gaps)
    >>> len(fv.changes_since(faulty, healthy, {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}).sentences()) > 0
    True
    """
    tables = [measured_given(path, columns) for path in (faulty, healthy)]
    given = model_given(model, kind, columns)
    files = {
        **tables[0].files("measured table", columns),
        **tables[1].files("healthy table", columns),
        **given.files("model", columns),
    }
    outlines = flexures_beside(tables[1].path), flexures_beside(tables[0].path)
    found = compare_with_healthy(tables[0].value, tables[1].value, given.value, outlines)
    return Changes(found, tables[0].path, provenance(files, call))
