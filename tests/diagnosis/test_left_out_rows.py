"""Rows that are excluded from the verdict are listed and drawn, and every count that includes them states it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.diagnosis.report.figure_files import residual_figure
from fingervision.diagnosis.report.report_page import report_page
from fingervision.diagnosis.report.sentences import within_clock
from fingervision.domain.measured_table import FoundClock
from fingervision.domain.report import Place
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.storage.provenance import AUTHORS, RELEASED, provenance
from fingervision.storage.summary_json import report_document

WRONG = (100, 250, 400)
OFFSET_MM, SPAN_MM = 0.02, 1.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tables with a gap at rest 0.02 mm larger than simulated and three gross errors of 2 mm; they have both edges."""
    out = tmp_path_factory.mktemp("left_out")
    rng = np.random.default_rng(11)
    time_s = 0.05 * np.arange(500)
    input_mm = 0.5 * SPAN_MM * np.sin(time_s)
    left, right = (sign * (1.0 + 0.5 * input_mm + 0.5 * OFFSET_MM) + rng.normal(0.0, 5e-4, 500) for sign in (-1, 1))
    right[list(WRONG)] += 2.0
    rows = [",".join(f"{x:.6f}" for x in row) for row in zip(time_s, input_mm, right - left, left, right, strict=True)]
    (out / "measured.csv").write_text("time_s,input_mm,gap_mm,left_mm,right_mm\n" + "\n".join(rows) + "\n")
    (out / "simulation.csv").write_text("input_mm,gap_mm\n-1,1\n1,3\n")
    return out


@pytest.fixture(scope="module")
def found(folder: Path) -> Diagnosis:
    return diagnose(read_measured_table(folder / "measured.csv"), read_model(folder / "simulation.csv"))


def test_sentence_shares_and_figures_count_the_same_rows(found: Diagnosis) -> None:
    d = found.report.disagreement
    assert found.left_out == WRONG
    kept = np.setdiff1d(np.arange(500), WRONG)
    gap, mid = (part[kept] for part in np.split(found.before_mm, 2))
    by_hand = np.sqrt(np.mean(0.25 * gap**2 + (mid - mid.mean()) ** 2))
    assert d.counted_before_rms_mm == pytest.approx(by_hand, rel=1e-9)
    assert d.before_rms_mm > 5.0 * by_hand
    assert d.counted_mm[1] / d.counted_mm[0] == pytest.approx(found.report.standing_share, rel=1e-9)
    assert (
        f"from {1e3 * d.counted_mm[0]:.3g} to {1e3 * d.counted_mm[1]:.3g} µm RMS of each finger's edge"
        in found.report.sentence
    )
    assert "with 3 of 500 rows left out" in found.report.sentence


def test_every_row_set_aside_is_named_with_its_time(found: Diagnosis) -> None:
    rows = [row for row in found.report.outlier_rows if not row["counted"]]
    assert [row["time_s"] for row in rows] == pytest.approx([5.0, 12.5, 20.0])
    assert all(row["gap_off_mm"] == pytest.approx(2.0, abs=0.01) for row in rows)
    assert "5 s, 12.5 s, 20 s" in found.report.outliers[0]


def test_the_scale_of_a_figure_is_that_of_the_rows_that_count(found: Diagnosis) -> None:
    figure = residual_figure({"gap": found.before_mm[:500]}, None, found.data.chain.history, found.left_out)
    axes = figure.axes[-1]
    assert axes.get_ylim()[1] < 2.0 * OFFSET_MM
    assert "3 of 3 rows left out lie outside the plot" in axes.get_title("right")


def test_the_page_scales_to_the_rows_that_count_and_is_citable(folder: Path, found: Diagnosis) -> None:
    page = report_page(found, provenance({"measured": folder / "measured.csv"}, "fingervision diagnose"), "")
    assert "3 of 3 rows left out lie outside the plot" in page
    assert f"{AUTHORS} ({RELEASED}). fingervision" in page
    cff = Path("CITATION.cff").read_text()
    assert AUTHORS in cff
    assert f"date-released: {RELEASED}" in cff
    assert len(report_document(found.report, None, None)["outlier_rows"]) == len(found.report.outlier_rows)


@pytest.mark.parametrize(("late_s", "u_s", "said"), [(0.004, 0.003, True), (0.004, 0.001, False), (0.004, 0.0, False)])
def test_a_difference_is_laid_to_the_clocks_only_within_their_uncertainty(
    found: Diagnosis, late_s: float, u_s: float, said: bool
) -> None:
    data = replace(found.data, table=replace(found.data.table, clock=FoundClock(u_s)))
    # The gap follows the input one to one, and the largest speed is 0.5 mm/s.
    size = late_s * 0.5
    ways: NDArray[np.float64] = np.array([1.0, -1.0])
    places = tuple(
        Place("gap", f"input, {way}", -0.05, 0.05, sign * size, "mm", 9.0, "there")
        for way, sign in zip(("opening", "closing"), ways, strict=True)
    )
    assert all(("clocks 4" in place.words) is said for place in within_clock(places, data))
    # Differences with the same sign in both directions are not caused by clocks.
    same = (places[0], replace(places[1], size=size))
    assert within_clock(same, data) == same
