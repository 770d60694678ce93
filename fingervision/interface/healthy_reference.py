"""Compare a recording with a healthy recording of the same specimen, and write what changed."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.diagnosis.bodies.reference_report import Compared, compare_with_healthy, drawing_svg
from fingervision.interface.tables import measured_given, model_given
from fingervision.storage.flexures_csv import flexures_beside
from fingervision.storage.out_folder import mark_owner, out_folder
from fingervision.storage.provenance import Provenance, provenance

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


def changes_since(faulty: Path, healthy: Path, model: Path, *, kind: str, columns: Path | None, call: str) -> Changes:
    """Compare a measured table with a healthy one of the same specimen; write nothing.

    Parameters
    ----------
    faulty, healthy : Path
        Measured tables; the flexures.csv beside each is used where both have one.
    model : Path
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
    """
    tables = [measured_given(path, columns) for path in (faulty, healthy)]
    given = model_given(model, kind, columns)
    files = {
        **tables[0].files("measured table", columns),
        **tables[1].files("healthy table", columns),
        **given.files("model", columns),
    }
    outlines = flexures_beside(healthy), flexures_beside(faulty)
    found = compare_with_healthy(tables[0].value, tables[1].value, given.value, outlines)
    return Changes(found, tables[0].path, provenance(files, call))


__all__ = ["CHANGES", "Changes", "changes_since"]
