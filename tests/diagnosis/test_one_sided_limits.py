"""If a warming is far from complete at the end of a table, its parameters are stated as limits, not as values."""

import json
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.report.html_parts import with_uncertainty
from fingervision.diagnosis.report.sentences import draws_of, limited, phrase
from fingervision.domain.parameter import Estimate, Parameter
from fingervision.domain.report import NamedEffect
from fingervision.storage.summary_json import report_document
from tests.diagnosis.tables import written

AMPLITUDE = Parameter("amplitude_mm", "mm", -2.0, 2.0, "final thermal change")
TAU = Parameter("tau_s", "s", 2.0, 3000.0, "thermal time constant", neutral=None)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_parameter_is_limited_on_the_side_away_from_which_the_open_one_leads_it(sign: float) -> None:
    # Only the rate is known: 0.1 um per second for any time constant between 1000 and 3000 s.
    tau_s = np.linspace(1000.0, 3000.0, 401)
    amplitude = sign * 1e-4 * tau_s
    of_tau, of_amplitude = limited(3000.0, TAU, tau_s, tau_s), limited(0.3 * sign, AMPLITUDE, amplitude, tau_s)
    assert of_tau.at_least == pytest.approx(1100.0)
    assert (of_amplitude.at_least if sign > 0.0 else of_amplitude.at_most) == pytest.approx(sign * 0.11)
    assert of_tau.u is of_amplitude.u is of_tau.at_most is None


def test_without_draws_nothing_is_stated() -> None:
    none = draws_of(({},), "thermal_drift", "tau_s")
    assert limited(3000.0, TAU, none, none) == Estimate(3000.0, None, "s")


def test_a_limit_is_shown_in_the_place_of_the_number() -> None:
    at = Estimate(3000.0, None, "s", at_least=2100.0)
    words = phrase(NamedEffect("thermal_drift", "mechanism", {"tau_s": at}))
    assert "at least 2100 s (95 %)" in words
    assert "3000" not in words + " ".join(with_uncertainty(at))


@pytest.mark.slow
@pytest.mark.parametrize("amplitude_mm", [0.5, -0.5])
def test_a_warming_three_times_slower_than_can_be_shown_gets_true_limits(tmp_path: Path, amplitude_mm: float) -> None:
    rng = np.random.default_rng(1)
    time_s, tau_s = 15.0 * np.arange(160), 9000.0
    at = 1.0 - np.cos(2.0 * np.pi * time_s / 600.0)
    gap = 4.0 + 7.7 * at + amplitude_mm * (1.0 - np.exp(-time_s / tau_s)) + 0.003 * rng.standard_normal(at.size)
    rows = (f"{t},{u:.5f},{g:.5f}" for t, u, g in zip(time_s, at, gap, strict=True))
    report = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", rows, "-1,-3.7\n3,27.1")).report
    assert [effect.name for effect in report.effects] == ["thermal_drift"]
    document = json.loads(json.dumps(report_document(report, None, None)["effects"]))[0]["parameters"]
    assert document["tau_s"]["u"] is document["amplitude_mm"]["u"] is None
    assert 1000.0 < document["tau_s"]["at_least"] <= tau_s
    side = "at_least" if amplitude_mm > 0.0 else "at_most"
    assert 0.0 < document["amplitude_mm"][side] / amplitude_mm <= 1.0
    assert f"{document['tau_s']['value']:.4g} s, U" not in report.sentence
