"""Effects from other distributions, from files and from this session: found, named, or refused with a sentence."""

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fingervision.cli import cli
from fingervision.domain.errors import UsageError
from fingervision.effects import REGISTRY, catalogue, origin_of, register
from fingervision.plugins.faults import (
    PluginError,
    PluginImportError,
    PluginNameError,
    PluginShapeError,
    PluginVersionError,
)
from tests.plugins.installed import effect_source, install

GROUP = "fingervision.effects"


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


def refused(name: str) -> str:
    (sentence,) = [one.sentence for one in REGISTRY.refusals() if one.name == name]
    return sentence


def test_an_installed_effect_is_listed_with_its_distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch, {GROUP: {"screw_bend": "fvdemo_a"}}, {"fvdemo_a": effect_source()})
    (line,) = [line for line in run("effects").output.splitlines() if line.startswith("screw_bend")]
    assert line.endswith("[fv-demo 1.2]")
    assert origin_of("backlash").built_in
    stages = [effect.stage for effect in catalogue().values()]
    assert stages == sorted(stages, key=["drive", "mechanism", "camera"].index)


def test_a_file_adds_its_effects_for_one_command(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(effect_source())
    assert f"[{file}]" in run("effects", "--effects", str(file)).output
    assert "screw_bend" not in catalogue()
    again = run("effects", "screw_bend", "--effects", str(file), "--effects", str(file.parent / "." / file.name))
    assert str(file) in again.output
    assert run("effects", "screw_bend").exit_code != 0


def test_what_a_file_imports_from_the_package_is_no_effect_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(effect_source() + "\nfrom fingervision.effects.backlash import EFFECT as PLAY\n")
    assert list(REGISTRY.in_file(file)) == ["screw_bend"]


def test_a_session_registers_an_effect_and_may_do_so_again(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(effect_source("bent_again"))
    (effect,) = REGISTRY.in_file(file).values()
    try:
        register(effect)
        register(effect)
        assert str(origin_of("bent_again")) == "this session"
    finally:
        REGISTRY.remove("bent_again")
    with pytest.raises(PluginNameError, match="backlash"):
        register(catalogue()["backlash"])
    with pytest.raises(PluginShapeError, match="int"):
        register(3)  # type: ignore[arg-type]


BAD = {
    "raises": ("raise RuntimeError('no licence')", "no licence"),
    "exits": ("import sys; sys.exit(3)", "SystemExit"),
    "lacks": ("import no_such_library", "no_such_library"),
    "no_effect": ("EFFECT = 'play'", "str"),
    "empty": ("", "no effect"),
    "other_name": (effect_source("another"), "another"),
    "wrong_shape": (
        effect_source("wrong_shape").replace("input_mm + values", "input_mm[:3] + 0 * values").replace(
            "* input_mm**3", ""
        ),
        "(12,)",
    ),
    "not_finite": (effect_source("not_finite").replace("input_mm**3", "np.inf"), "finite"),
    "in_place": (
        effect_source("in_place").replace("return input_mm +", "input_mm += 1.0; return input_mm +"),
        "in place",
    ),
    "backlash": (effect_source("backlash"), "built-in"),
    "loops": ("while True:\n    pass", "1 s"),
    "waits": ("import time; time.sleep(4.0)", "1 s"),
}  # fmt: skip


@pytest.mark.slow
def test_each_bad_plug_in_is_said_by_name_and_takes_nothing_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FINGERVISION_PLUGIN_SECONDS", "1")
    points = {name: f"fvdemo_{name}" for name in BAD} | {"good_one": "fvdemo_good"}
    modules = {f"fvdemo_{name}": source for name, (source, _) in BAD.items()}
    install(tmp_path, monkeypatch, {GROUP: points}, modules | {"fvdemo_good": effect_source("good_one")})
    own = {name for name in catalogue() if origin_of(name).built_in}
    assert set(catalogue()) == own | {"good_one"}
    assert len(REGISTRY.refusals()) == len(BAD)
    for name, (_, fact) in BAD.items():
        sentence = refused(name)
        assert fact in sentence
        assert name in sentence
        assert "fv-demo 1.2" in sentence
        assert "pip uninstall fv-demo" in sentence
        assert sentence.count(". ") == 0
        assert sentence.endswith(".")
    result = run("effects")
    assert result.exit_code == 0
    assert "good_one" in result.output


def test_two_distributions_that_claim_one_name_are_both_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("fv-one", "fv-two"):
        install(tmp_path, monkeypatch, {GROUP: {"screw_bend": "fvdemo_b"}}, {"fvdemo_b": effect_source()}, name=name)
    assert "screw_bend" not in catalogue()
    assert {str(one.origin) for one in REGISTRY.refusals()} == {"fv-one 1.2", "fv-two 1.2"}


def test_a_plug_in_for_a_newer_version_is_refused_before_it_is_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(
        tmp_path, monkeypatch, {GROUP: {"later": "fvdemo_later"}}, {"fvdemo_later": "raise RuntimeError('imported')"},
        requires="fingervision>=99.0",
    )  # fmt: skip
    assert ">=99.0" in refused("later")
    assert "imported" not in refused("later")
    file = tmp_path / "later.py"
    file.write_text('# /// script\n# dependencies = ["fingervision>=99.0"]\n# ///\nraise RuntimeError("imported")\n')
    with pytest.raises(PluginVersionError, match=r">=99\.0"):
        REGISTRY.in_file(file)


@pytest.mark.parametrize(
    ("name", "text", "error"),
    [
        ("none.py", None, UsageError),
        ("mine.txt", "", UsageError),
        ("empty.py", "", UsageError),
        ("broken.py", "def act(:", PluginImportError),
        ("taken.py", effect_source("backlash"), PluginNameError),
        ("latin.py", b"# \xe4", UsageError),
    ],
)
def test_a_bad_file_ends_the_command_with_its_name(
    tmp_path: Path, name: str, text: str | bytes | None, error: type[Exception]
) -> None:
    file = tmp_path / name
    if text is not None:
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
    result = run("effects", "--effects", str(file))
    assert isinstance(result.exception, error)
    assert name in str(result.exception)


def test_a_plug_in_that_looks_at_the_catalogue_while_it_is_imported_sees_what_is_built_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = "from fingervision.effects import catalogue\nSEEN = list(catalogue())\n" + effect_source("looks_round")
    install(tmp_path, monkeypatch, {GROUP: {"looks_round": "fvdemo_c"}}, {"fvdemo_c": source})
    assert "looks_round" in catalogue()
    assert "looks_round" not in sys.modules["fvdemo_c"].SEEN


def test_an_unsound_time_limit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGERVISION_PLUGIN_SECONDS", "soon")
    install(tmp_path, monkeypatch, {GROUP: {"screw_bend": "fvdemo_d"}}, {"fvdemo_d": effect_source()})
    assert "FINGERVISION_PLUGIN_SECONDS" in str(run("effects").exception)
    assert not isinstance(run("effects").exception, PluginError)


@pytest.mark.slow
def test_help_and_import_touch_no_plug_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mark = tmp_path / "imported"
    source = f"open({str(mark)!r}, 'w').close()\n" + effect_source()
    install(tmp_path, monkeypatch, {GROUP: {"screw_bend": "fvdemo_e"}}, {"fvdemo_e": source})
    path = {"PYTHONPATH": ":".join([str(tmp_path / "fv-demo"), str(Path(__file__).parents[2])])}
    for words in (
        ["-c", "import fingervision"],
        ["-m", "fingervision", "-h"],
        ["-m", "fingervision", "diagnose", "-h"],
    ):
        subprocess.run([sys.executable, *words], env=path, check=True, capture_output=True)
    assert not mark.exists()
    subprocess.run([sys.executable, "-m", "fingervision", "effects"], env=path, check=True, capture_output=True)
    assert mark.exists()
