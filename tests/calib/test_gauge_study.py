"""Gauge studies with a published answer, and agreement by E_n."""

import numpy as np
import pytest

from calib.errors import CalibrationError
from calib.gauge_study import Agreement, gauge_study, verdict

# AIAG, Measurement Systems Analysis, 4th ed. 2010, figure III-B 15: three appraisers, ten parts, three trials.
AIAG = np.array(
    [
        [0.29, -0.56, 1.34, 0.47, -0.80, 0.02, 0.59, -0.31, 2.26, -1.36],
        [0.41, -0.68, 1.17, 0.50, -0.92, -0.11, 0.75, -0.20, 1.99, -1.25],
        [0.64, -0.58, 1.27, 0.64, -0.84, -0.21, 0.66, -0.17, 2.01, -1.31],
        [0.08, -0.47, 1.19, 0.01, -0.56, -0.20, 0.47, -0.63, 1.80, -1.68],
        [0.25, -1.22, 0.94, 1.03, -1.20, 0.22, 0.55, 0.08, 2.12, -1.62],
        [0.07, -0.68, 1.34, 0.20, -1.28, 0.06, 0.83, -0.34, 2.19, -1.50],
        [0.04, -1.38, 0.88, 0.14, -1.46, -0.29, 0.02, -0.46, 1.77, -1.49],
        [-0.11, -1.13, 1.09, 0.20, -1.07, -0.67, 0.01, -0.56, 1.45, -1.77],
        [-0.15, -0.96, 0.67, 0.11, -1.45, -0.49, 0.21, -0.49, 1.87, -2.16],
    ]
).reshape(3, 3, 10)
# The manual prints five decimals.
PRINTED = 5e-5


def test_the_manuals_own_study() -> None:
    study = gauge_study(AIAG.transpose(0, 2, 1).tolist())
    assert study.repeatability_mm == pytest.approx(0.199933, abs=PRINTED)
    assert study.reproducibility_mm == pytest.approx(0.226838, abs=PRINTED)
    assert study.grr_mm == pytest.approx(0.302373, abs=PRINTED)
    assert study.part_mm == pytest.approx(1.042327, abs=PRINTED)
    assert study.percent_of_total == pytest.approx(27.86, abs=0.01)


def test_true_components_are_found() -> None:
    rng = np.random.default_rng(5)
    readings = rng.normal(0, 1.0, (1, 400, 1)) + rng.normal(0, 0.5, (400, 1, 1)) + rng.normal(0, 0.2, (400, 400, 2))
    study = gauge_study(readings.tolist())
    # 400 recordings know their own scatter to 3.5 %.
    assert study.repeatability_mm == pytest.approx(0.2, rel=0.02)
    assert study.reproducibility_mm == pytest.approx(0.5, rel=0.1)
    assert study.part_mm == pytest.approx(1.0, rel=0.1)
    assert study.percent_of(10.0) == pytest.approx(60.0 * study.grr_mm)


def test_one_part_has_no_variation_of_parts() -> None:
    study = gauge_study([[[1.0, 1.1, 0.9]], [[1.2, 1.0, 1.1]]])
    assert study.part_mm == 0.0
    assert study.percent_of_total is None


@pytest.mark.parametrize(
    ("readings", "sentence"),
    [
        ([[[1.0, 1.1]]], "at least two recordings, but there are 1"),
        ([[[1.0]], [[1.1]]], "at least two readings of each part, but there are 1"),
        ([[[1.0, 1.1]], [[1.0, 1.1, 1.2]]], "the same number of readings"),
        ([[[1.0, float("nan")]], [[1.0, 1.1]]], "some are missing"),
    ],
)
def test_what_cannot_be_studied(readings: list[list[list[float]]], sentence: str) -> None:
    with pytest.raises(CalibrationError, match=sentence):
        gauge_study(readings)


def test_verdicts_and_tolerance() -> None:
    assert [verdict(percent) for percent in (5.0, 20.0, 40.0)] == [
        "acceptable",
        "may be acceptable for some uses",
        "not acceptable",
    ]
    with pytest.raises(CalibrationError, match="tolerance must be positive, but is 0"):
        gauge_study([[[1.0, 1.1]], [[1.0, 1.1]]]).percent_of(0.0)


def test_agreement_is_within_the_expanded_uncertainty() -> None:
    assert Agreement(7.506, 0.003, 7.5, 0.0).e_n == pytest.approx(1.0)
    assert Agreement(7.504, 0.0024, 7.5, 0.0018).agrees
    assert not Agreement(7.493, 0.0024, 7.5, 0.0018).agrees
