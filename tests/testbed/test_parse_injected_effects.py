"""Effects to be added to the simulation, from text: by name alone, with parameter values, or from a sealed file."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DataError, UsageError
from fingervision.effects import catalogue
from fingervision.testbed.simulation.injected_effects import hidden_from, usual_values


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_every_effect_has_a_usual_size_inside_its_bounds_that_does_something(name: str) -> None:
    effect = catalogue()[name]
    values = usual_values(effect)
    assert set(values) == {p.name for p in effect.parameters}
    assert all(p.lower <= values[p.name] <= p.upper for p in effect.parameters)
    # An effect without neutral values (ringing) acts as soon as it is named.
    assert all(p.neutral is None for p in effect.parameters) or any(
        p.neutral is not None and values[p.name] != p.neutral for p in effect.parameters
    )


def test_sizes_that_are_given_replace_the_usual_ones() -> None:
    hidden = hidden_from(("friction_hysteresis:fraction=0.3", "camera_tilt"))
    assert hidden.effects["friction_hysteresis"]["fraction"] == 0.3
    assert set(hidden.effects) == {"friction_hysteresis", "camera_tilt"}


def test_a_sealed_file_hides_what_it_says(tmp_path: Path) -> None:
    sealed = tmp_path / "sealed.toml"
    sealed.write_text('[[effect]]\nname = "backlash"\n[effect.parameters]\nplay_mm = 0.07\n')
    assert hidden_from((str(sealed),)).effects == {"backlash": {"play_mm": 0.07}}


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("backlsh", "hide must be an effect, but is 'backlsh': did you mean backlash?"),
        ("backlash:play=0.1", "A parameter of backlash must be one of play_mm, but is play."),
        ("backlash:play_mm=9", "play_mm of backlash must be between 0 and 0.5, but is 9."),
        ("backlash:play_mm=a", "play_mm of backlash must be a number, but is a."),
        ("backlash:play_mm", "--hide must be EFFECT or EFFECT:PARAMETER=VALUE,..., but is backlash:play_mm."),
    ],
)
def test_what_cannot_be_hidden_is_said(word: str, sentence: str) -> None:
    with pytest.raises(UsageError) as caught:
        hidden_from((word,))
    assert str(caught.value) == sentence


def test_a_sealed_file_without_an_effect_is_said(tmp_path: Path) -> None:
    sealed = tmp_path / "sealed.toml"
    sealed.write_text("schema = 1\n")
    with pytest.raises(DataError, match="must have at least one"):
        hidden_from((str(sealed),))
