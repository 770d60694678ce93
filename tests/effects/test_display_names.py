"""Parameters have display names: they are declared in the effect's own file and used in sentences, while files keep the
keys.
"""

import pytest

from fingervision.diagnosis.report.sentences import phrase
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import NamedEffect
from fingervision.effects import catalogue


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_parameter_has_a_name_for_readers(name: str) -> None:
    parameters = catalogue()[name].parameters
    words = [p.words for p in parameters]
    assert len(set(words)) == len(words)
    for p in parameters:
        assert "_" not in p.words
        assert len(p.words) >= 6
        assert p.words[0].islower()


@pytest.mark.parametrize("name", list(catalogue()))
def test_sentences_show_it_in_the_place_of_the_key(name: str) -> None:
    effect = catalogue()[name]
    parameters = {p.name: Estimate(0.0125, 0.0004, p.unit) for p in effect.parameters}
    said = phrase(NamedEffect(name, str(effect.stage), parameters, shown={p.name: p.words for p in effect.parameters}))
    assert said.startswith(f"{name} (")
    for p in effect.parameters:
        unit = f" {p.unit}" if p.unit else ""
        assert f"{p.words} 0.0125{unit}, U = 0.0008{unit}" in said
        assert "_" not in said.removeprefix(name)
    assert said.endswith("k = 2)")


def test_a_key_without_a_name_stays() -> None:
    assert "play_mm 0.01 mm)" in phrase(NamedEffect("backlash", "drive", {"play_mm": Estimate(0.01, None, "mm")}))
