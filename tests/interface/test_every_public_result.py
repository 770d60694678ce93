"""Every public class: an example on its page, results that go to other processes whole, and a short text of each."""

import doctest
import importlib
import inspect
import pickle
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import calib
import fingervision as fv
from fingervision.effects import withdraw

LONGEST_REPR = 600
PACKAGES = (fv, calib)
# A protocol, and what holds open devices.
WITHOUT_INSTANCE = {"FrameSource", "OpenBed"}
THINGS = {
    f"{package.__name__}.{name}": getattr(package, name)
    for package in PACKAGES
    for name in package.__all__
    if name not in ("__version__", "batch", "effects")
}
CLASSES = {path: thing for path, thing in THINGS.items() if inspect.isclass(thing)}
TABLE = {"input_mm": [-0.5, 2.0], "gap_mm": [0.5, 20.5]}
TIME_S = 0.04 * np.arange(120)
INPUT_MM = np.abs(np.arange(120) % 60 - 30) / 30.0
HEALTHY = {"time_s": TIME_S, "input_mm": INPUT_MM, "gap_mm": 4.5 + 8.0 * INPUT_MM}
FAULTY = HEALTHY | {"gap_mm": HEALTHY["gap_mm"] + 0.3}


def as_it_was(value: Any) -> Any:
    again = pickle.loads(pickle.dumps(value))
    assert type(again) is type(value)
    assert repr(again) == repr(value)
    return again


def test_the_examples_make_every_public_record_and_each_goes_to_another_process(tmp_path: Path) -> None:
    """The values of all examples, and what they hold, are pickled; so are those that the reference of Python makes."""
    met = dict[type, Any]()
    for path, thing in THINGS.items():
        example = doctest.DocTestParser().get_doctest(inspect.getdoc(thing) or "", {}, path, None, 0)
        failed = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, clear_globs=False).failed
        assert not failed, path
        for value in example.globs.values():
            look(value, met)
    more = (
        fv.simulate(TABLE, HEALTHY), fv.changes_since(FAULTY, HEALTHY, TABLE), fv.Parameter("a", "", 0.0, 1.0, "a"),
        fv.LostFrame(3, 0.12, fv.Status.DAMAGED, "Lost."), calib.StatedScale(34.0, 0.1),
        calib.Agreement(5.001, 0.001, 5.0, 0.001), calib.Lens(np.linspace(1.0, 2.0, 9), np.zeros((9, 9))),
    )  # fmt: skip
    for value in more:
        look(value, met)
    made = {each for kind in met for each in kind.__mro__}
    errors = {each for each in CLASSES.values() if issubclass(each, Exception)}
    left = {path for path, kind in CLASSES.items() if kind not in made | errors}
    assert left <= {f"fingervision.{name}" for name in WITHOUT_INSTANCE}


def look(value: Any, met: dict[type, Any], depth: int = 3) -> None:
    """Pickle a value of a public class, and what it holds."""
    public = any(
        isinstance(value, kind) for path, kind in CLASSES.items() if path.split(".")[1] not in WITHOUT_INSTANCE
    )
    if public and type(value) not in met:
        met[type(value)] = as_it_was(value)
        assert len(repr(value)) < LONGEST_REPR, type(value)
    if depth and (public or isinstance(value, tuple | list | dict | MappingProxyType)):
        held = value if isinstance(value, tuple | list) else value.values() if hasattr(value, "values") else ()
        names = getattr(value, "__dataclass_fields__", {})
        for each in (*held, *(getattr(value, name) for name in names)):
            look(each, met, depth - 1)


# Errors that are not made of a message alone.
MADE_OF = {
    fv.ArgumentError: ("frames", "be a number", "is 'x'"),
    fv.ArgumentTypeError: ("frames", "be a number", "is 'x'"),
    fv.EffectAnswerError: ("bump", "must give numbers, but gave None"),
    fv.MissingLibraryError: ("pandas", "dataframe", "to_dataframe"),
    fv.OpenQuestionError: (Path("table.csv"), "table", ()),
    fv.UnknownNameError: ("effect", "backlsh", ["backlash"], "the name of an effect"),
}


@pytest.mark.parametrize("kind", [kind for kind in CLASSES.values() if issubclass(kind, Exception)])
def test_an_error_reaches_another_process_with_what_it_says(kind: type[Exception]) -> None:
    """An error that cannot be unpickled breaks the pool of processes that it comes from."""
    error = kind(*MADE_OF.get(kind, ("What it says.",)))
    again = as_it_was(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_every_page_has_an_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs")
    importlib.import_module("generate.python_interface").python_page(tmp_path / "python")
    for path, thing in THINGS.items():
        page = f"{path}-{'class' if inspect.isclass(thing) else 'use'}.md"
        own = ">>>" in (inspect.getdoc(thing) or "")
        assert own or ">>>" in (tmp_path / "python" / page).read_text(encoding="utf-8"), path


@pytest.mark.parametrize(
    "result",
    [
        lambda model: fv.diagnose(HEALTHY, model),
        lambda model: fv.compare(HEALTHY, model),
        lambda model: fv.simulate(model, HEALTHY),
    ],
    ids=["diagnose", "compare", "simulate"],
)
@pytest.mark.parametrize("by", [["pickle"], ["pickle", "cloudpickle"]], ids=["alone", "cloudpickle"])
def test_a_result_by_a_lambda_goes_to_another_process(
    result: Callable[[Any], Any], by: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The numbers always go; the lambda itself does where cloudpickle is there, as with Dask and joblib."""
    monkeypatch.setattr("fingervision.models.function_model.PICKLED_BY", by)
    as_it_was(result(lambda time_s, input_mm: 4.5 + 8.0 * input_mm))


def test_a_corrected_model_of_a_lambda_says_that_its_function_stayed(monkeypatch: pytest.MonkeyPatch) -> None:
    found = fv.diagnose(FAULTY, lambda time_s, input_mm: 4.5 + 8.0 * input_mm).corrected_model
    sent = as_it_was(found)
    before = fv.simulate(found, HEALTHY).gap_mm
    assert np.allclose(fv.simulate(sent, HEALTHY).gap_mm, before)
    monkeypatch.setattr("fingervision.models.function_model.PICKLED_BY", ["pickle"])
    with pytest.raises(fv.ModelError, match="stayed"):
        fv.simulate(as_it_was(found), HEALTHY)


@fv.effect("mechanism", fv.Parameter("height_mm", "mm", -0.2, 0.2, "height of the bump"))
def bump_of_this_module(points, history, values):  # type: ignore[no-untyped-def]
    """The gap bulges in the middle."""
    return points.with_gap(points.gap_mm + values["height_mm"] * np.exp(-0.5 * ((history.input_mm - 0.5) / 0.1) ** 2))


withdraw("bump_of_this_module")


def test_an_effect_of_ones_own_goes_to_another_process() -> None:
    assert pickle.loads(pickle.dumps(bump_of_this_module)) is bump_of_this_module


@pytest.mark.parametrize("kind", ["lumped", "stiffness_matrix", pytest.param("finite_element", marks=pytest.mark.slow)])
def test_a_model_of_a_drawing_goes_to_another_process(kind: str) -> None:
    predicted = fv.model("sample_frames/paper/gripper.toml", kind=kind)
    sent = as_it_was(predicted)
    inputs = predicted.input_mm[::20]
    assert np.array_equal(sent.models[kind].respond(inputs).gap_mm, predicted.models[kind].respond(inputs).gap_mm)
