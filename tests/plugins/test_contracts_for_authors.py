"""Contract tests from the view of a plug-in's author: failures are sentences, and pytest is not imported."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.effect import DriveEffect, Effect
from fingervision.domain.parameter import Parameter
from fingervision.effects import REGISTRY, catalogue, register
from fingervision.testbed.bed import Bed
from fingervision.testbed.clocks.clock import VirtualClock
from fingervision.testing import (
    ActuatorContract,
    EffectContract,
    HiddenEffectContract,
    ModelContract,
    bed_at,
    checks_of,
    diagnosed,
    run,
)
from tests.plugins.installed import effect_source
from tests.plugins.test_devices_from_elsewhere import SPRING, STAGE


def effect_in(folder: Path, **changes: object) -> Effect:
    (folder / "mine.py").write_text(effect_source(), encoding="utf-8")
    (effect,) = REGISTRY.in_file(folder / "mine.py").values()
    return replace(effect, **changes)  # type: ignore[arg-type]


def test_a_sound_effect_passes(tmp_path: Path) -> None:
    assert run(EffectContract, effect=effect_in(tmp_path)) == {}


BAD: dict[str, tuple[object, str]] = {
    "test_neutral_parameters_change_nothing": (lambda u, h, v: u + 0.1 + v["bend_per_mm2"] * u**3, "0.385"),
    "test_it_shows": (lambda u, h, v: u + 1e-9 * v["bend_per_mm2"] * u, "changes them by"),
    "test_the_same_values_give_the_same_answer": (
        lambda u, h, v: u + v["bend_per_mm2"] * np.random.default_rng().random(u.size),
        "results differ by",
    ),
    "test_it_answers_at_its_bounds": (
        lambda u, h, v: u + (v["bend_per_mm2"] if abs(v["bend_per_mm2"]) < 0.09 else np.inf),
        "inf",
    ),
    "test_without_times_it_works_unless_it_says_that_it_needs_them": (
        lambda u, h, v: u + v["bend_per_mm2"] * h.times,
        "times",
    ),
}


@pytest.mark.parametrize("check", BAD)
def test_each_fault_is_a_sentence_with_the_effect_and_the_figure(check: str, tmp_path: Path) -> None:
    act, fact = BAD[check]
    effect = effect_in(tmp_path)
    assert isinstance(effect, DriveEffect)
    failed = run(EffectContract, effect=replace(effect, act=act))
    assert check in failed
    assert "screw_bend" in failed[check]
    if fact != "inf":
        assert fact in failed[check]


def test_a_play_without_memory_or_mirror_is_found_out() -> None:
    play = catalogue()["backlash"]
    assert run(EffectContract, effect=replace(play, start="")) == {}
    tilted = run(EffectContract, effect=replace(catalogue()["camera_tilt"], odd=()))
    assert list(tilted) == ["test_a_mirrored_picture_mirrors_the_answer"]


def test_a_model_that_does_not_keep_its_figures_is_found_out(tmp_path: Path) -> None:
    from fingervision.models.kinds import REGISTRY as MODELS

    (tmp_path / "spring.py").write_text(SPRING, encoding="utf-8")
    (kind,) = MODELS.in_file(tmp_path / "spring.py").values()
    assert run(ModelContract, kind=kind) == {}
    (tmp_path / "other.py").write_text(SPRING.replace("ModelFigures(7.7", "ModelFigures(7.0"), encoding="utf-8")
    (kind,) = MODELS.in_file(tmp_path / "other.py").values()
    failed = run(ModelContract, kind=kind)
    assert list(failed) == ["test_its_figures_are_those_of_its_answer"]
    assert "7.7" in failed["test_its_figures_are_those_of_its_answer"]


def test_a_stage_in_a_file_keeps_the_contract_and_a_bad_one_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Nobody waits for a motion.
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: VirtualClock(begin_s=100.0))
    for name, source in (
        ("good", STAGE),
        ("drifts", STAGE.replace("self._from_mm = self._to_mm = self._at_mm(now_s)", "pass")),
    ):
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        path = tmp_path / "bed.toml"
        path.write_text(f'schema = 1\n[actuator]\nkind = "./{name}.py"\nupper_mm = 3.0\n', encoding="utf-8")

        class Contract(ActuatorContract):
            def open_bed(self, path: Path = path) -> Bed:
                return bed_at(path)

        failed = run(Contract)
        assert (failed == {}) == (name == "good"), failed
    assert "stage of a plug-in" in failed["test_a_jog_ends_with_a_stop"]


@pytest.mark.slow
def test_the_diagnosis_names_an_effect_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(effect_source("bent_screw"), encoding="utf-8")
    (effect,) = REGISTRY.in_file(tmp_path / "mine.py").values()
    try:
        register(effect)
        report = diagnosed("bent_screw", {"bend_per_mm2": 0.03})
    finally:
        REGISTRY.remove("bent_screw")
    assert ["bent_screw"] in [list(names) for names in report.alternatives]
    (named,) = report.effects
    if named.name == "bent_screw":
        found = named.parameters["bend_per_mm2"]
        assert found.u is not None
        assert abs(found.value - 0.03) < 4.0 * found.u


@pytest.mark.slow
@pytest.mark.parametrize("starts", [1, 12])
def test_a_period_with_one_start_is_found_out(starts: int) -> None:
    """For a wave over the input, one starting value is not enough to find the period, and another effect is named."""

    def act(input_mm, history, values):
        return input_mm + values["height_mm"] * np.sin(2.0 * np.pi * input_mm / values["period_mm"]) ** 3

    effect = DriveEffect(
        name="cubed_wave", stage="drive", order=36, words="the stage errs in cubed waves", formula="made up",
        source="made up", residual="waves over the input", act=act,
        parameters=(
            Parameter("height_mm", "mm", 0.0, 0.05, "height of the waves"),
            Parameter("period_mm", "mm", 0.1, 2.0, "period", neutral=None, starts=starts, reciprocal=True),
        ),
    )  # fmt: skip
    failed = run(HiddenEffectContract, effect=effect)
    assert "cubed_wave" not in catalogue()
    if starts == 1:
        assert "period_mm more starts" in failed["test_the_diagnosis_finds_it_again"]
    else:
        assert failed == {}


@pytest.mark.slow
def test_an_effect_that_fails_at_some_values_is_left_out_of_the_diagnosis(tmp_path: Path) -> None:
    source = effect_source("brittle").replace(
        "    return input_mm", "    if len(input_mm) > 100:\n        raise OSError('broken')\n    return input_mm"
    )
    (tmp_path / "mine.py").write_text(source, encoding="utf-8")
    (effect,) = REGISTRY.in_file(tmp_path / "mine.py").values()
    try:
        register(effect)
        report = diagnosed("rest_gap_error", {"offset_mm": 0.05})
    finally:
        REGISTRY.remove("brittle")
    (why,) = [one["reason"] for one in report.excluded if one["name"] == "brittle"]
    assert "broken" in why
    assert any("rest_gap_error" in names for names in report.alternatives)


@pytest.mark.slow
def test_the_contracts_need_no_pytest() -> None:
    program = (
        "import sys; import fingervision.testing as t; assert 'pytest' not in sys.modules; "
        "print(len(t.checks_of(t.EffectContract)))"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert int(done.stdout) == len(checks_of(EffectContract))
