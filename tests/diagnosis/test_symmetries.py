"""The diagnosis does not depend on the order of rows and columns, the names of runs, or a mirrored picture."""

import json
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import DiagnosisReport
from fingervision.storage.summary_json import report_document
from tests.diagnosis.tables import written

EDGE_MM = 0.004
SEED = 5
MIRRORED = 1e-3
"""Relative tolerance: rounding differs in the fit of a mirrored table, which converges to 0.1 % of the same values."""
COLUMNS = ("run", "time_s", "input_mm", "gap_mm", "left_mm", "right_mm")
Row = tuple[str, ...]


def rows(mirror: bool) -> list[Row]:
    """Two runs of a gripper with play that opens less than simulated."""
    rng = np.random.default_rng(SEED)
    out: list[Row] = []
    for run in range(2):
        u = (0.5 + 0.1 * run) * np.sin(np.linspace(0.0, 9.0, 90))
        stage = [float(u[0])]
        for x in u[1:]:
            stage.append(min(max(stage[-1], float(x) - 0.01), float(x) + 0.01))
        gap = 4.0 + 7.0 * np.array(stage)
        left, right = (0.2 + side * gap / 2 + EDGE_MM * rng.standard_normal(u.size) for side in (-1.0, 1.0))
        if mirror:
            left, right = -right, -left
        out += [
            tuple(map(repr, (run, 30.0 * run + 0.1 * k, float(u[k]), float(right[k] - left[k]), float(left[k]),
                             float(right[k]))))
            for k in range(u.size)
        ]  # fmt: skip
    return out


def asked(folder: Path, table: list[Row], columns: tuple[str, ...] = COLUMNS) -> DiagnosisReport:
    picked = [COLUMNS.index(column) for column in columns]
    rows = (",".join(row[k] for k in picked) for row in table)
    return diagnose(*written(folder, ",".join(columns), rows, "-0.8,-1.6\n0.8,9.6"), seed=SEED).report


def told(report: DiagnosisReport) -> str:
    """The report document without the processing time."""
    return json.dumps({k: v for k, v in report_document(report, None, None).items() if k != "seconds"}, sort_keys=True)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> DiagnosisReport:
    return asked(tmp_path_factory.mktemp("plain"), rows(mirror=False))


def test_order_and_names_change_nothing(plain: DiagnosisReport, tmp_path: Path) -> None:
    rng = np.random.default_rng(SEED)
    # The names come in the other order than the runs.
    table = [(("run 7", "0")[int(row[0])], *row[1:]) for row in rows(mirror=False)]
    report = asked(tmp_path, [table[k] for k in rng.permutation(180)], tuple(rng.permutation(COLUMNS).tolist()))
    assert told(report) == told(plain)


def test_a_mirrored_picture_has_the_same_answer(plain: DiagnosisReport, tmp_path: Path) -> None:
    mirrored = asked(tmp_path, rows(mirror=True))
    assert (mirrored.verdict, mirrored.alternatives) == (plain.verdict, plain.alternatives)
    for one, other in zip(mirrored.effects, plain.effects, strict=True):
        for key, estimate in one.parameters.items():
            assert estimate.value == pytest.approx(other.parameters[key].value, rel=MIRRORED)
