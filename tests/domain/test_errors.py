"""Classes of errors: each raise has one that says what kind of fault it is, and the exit code of its command."""

import ast
import inspect
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain import errors
from fingervision.domain.errors import ExitCode, FingervisionError, UsageError

PACKAGE = Path(fv.__file__).parent
CLASSES = [each for _, each in inspect.getmembers(errors, inspect.isclass) if issubclass(each, FingervisionError)]


def test_no_raise_is_of_the_base_class() -> None:
    """Whoever catches an error can ask what kind of fault it is."""
    suspects = [path for path in PACKAGE.rglob("*.py") if "FingervisionError(" in path.read_text(encoding="utf-8")]
    base = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in suspects
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "FingervisionError"
    ]
    assert not base


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_wrong_requests_end_with_2_and_everything_else_with_1(kind: type[FingervisionError]) -> None:
    assert kind.exit_code == (ExitCode.WRONG_USAGE if issubclass(kind, UsageError) else ExitCode.COULD_NOT)


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_every_class_stands_in_the_overview(kind: type[FingervisionError]) -> None:
    assert kind.__name__ in (errors.__doc__ or "")


def test_a_file_that_is_not_there_is_also_an_os_error(tmp_path: Path) -> None:
    for call in (fv.read_table, fv.read_model, fv.Calibration.load):
        with pytest.raises(fv.InputFileError, match=r"none\.\w+") as caught:
            call(tmp_path / ("none.json" if call is fv.Calibration.load else "none.csv"))
        assert isinstance(caught.value, OSError)


def test_a_file_with_the_wrong_content_is_also_a_value_error(tmp_path: Path) -> None:
    for name, call in (("x.csv", fv.read_table), ("x.toml", fv.read_model), ("x.json", fv.Calibration.load)):
        (tmp_path / name).write_text("colour,shape\nred,round\n")
        with pytest.raises(fv.DataError) as caught:
            call(tmp_path / name)
        assert isinstance(caught.value, ValueError)


def test_pictures_without_an_edge_give_no_calibration() -> None:
    with pytest.raises(fv.NoCalibrationError):
        fv.calibrate("slot", [(np.full((200, 300), 90, np.uint8), 2.0)])


def test_a_result_that_cannot_be_written_is_also_an_os_error(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file\n")
    with pytest.raises(fv.OutputError) as caught:
        fv.simulate({"input_mm": [0.0, 1.0], "gap_mm": [1.0, 2.0]}, [0.0, 0.5]).save(tmp_path / "taken" / "x.csv")
    assert isinstance(caught.value, OSError)
