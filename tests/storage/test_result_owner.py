"""Results belong to one input: two never share a folder, named or not, and both may move together."""

import json
import os
from pathlib import Path

import pytest

from fingervision.domain.errors import UsageError
from fingervision.storage.out_folder import mark_owner, own_folder


def test_a_named_folder_with_the_results_of_another_input_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "results"
    mark_owner(out, tmp_path / "day1" / "run1.mp4")
    assert own_folder(out, tmp_path / "day1" / "run1.mp4", named=True) == out
    with pytest.raises(UsageError, match=r"day1/run1\.mp4"):
        own_folder(out, tmp_path / "day2" / "run1.mp4", named=True)


def test_the_usual_folder_goes_beside_the_results_of_another_input(tmp_path: Path) -> None:
    out, first, second = tmp_path / "run1_out", tmp_path / "day1" / "run1.mp4", tmp_path / "day2" / "run1.mp4"
    assert own_folder(out, first, named=False) == out
    mark_owner(out, first)
    beside = own_folder(out, second, named=False)
    assert beside not in (out, tmp_path)
    assert not beside.exists()
    mark_owner(beside, second)
    # Asked again, each finds its own; a third gets one more.
    assert own_folder(out, first, named=False) == out
    assert own_folder(out, second, named=False) == beside
    third = own_folder(out, tmp_path / "day3" / "run1.mp4", named=False)
    assert third not in (out, beside)


@pytest.mark.parametrize("mark", ["", "{", "[]", '{"input": 3}', json.dumps({"schema": 1})])
def test_a_mark_that_cannot_be_read_is_nobodys(tmp_path: Path, mark: str) -> None:
    (tmp_path / ".fingervision.json").write_text(mark)
    assert own_folder(tmp_path, tmp_path / "run.mp4", named=True) == tmp_path


def test_an_input_whose_name_is_not_utf8_is_found_again(tmp_path: Path) -> None:
    source = tmp_path / os.fsdecode(b"caf\xe9.csv")
    source.write_text("a\n")
    (tmp_path / "out").mkdir()
    mark_owner(tmp_path / "out", source)
    assert own_folder(tmp_path / "out", source, named=True) == tmp_path / "out"
    with pytest.raises(UsageError, match="holds the results of"):
        own_folder(tmp_path / "out", tmp_path / "other.csv", named=True)
