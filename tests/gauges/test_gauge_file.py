"""The file gauges.toml: valid content is read, and every invalid content gives an error sentence."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DataError, InputFileError
from fingervision.domain.field import names_of
from fingervision.gauges.gauge_file import Gauge, check_gauges, read_gauges
from fingervision.gauges.kinds import kind_named, kinds

EDGE = 'name = "a"\nkind = "edge"\nx_px = 10\ny_px = 20.5\ndirection_deg = 90\nlength_px = 30\n'


def _read(folder: Path, text: str) -> tuple[Gauge, ...]:
    path = folder / "gauges.toml"
    path.write_text(text, encoding="utf-8")
    return read_gauges(path)


def _with(line: str, instead: str) -> str:
    key = line.split("=")[0].strip()
    kept = [own for own in EDGE.splitlines() if own.split("=")[0].strip() != key]
    return "schema = 1\n[[gauge]]\n" + "\n".join([*kept, instead]) + "\n"


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("", ["schema"]),
        ("schema = 1\n", ["[[gauge]]", "0"]),
        ("schema = 2\n[[gauge]]\n" + EDGE, ["schema", "2"]),
        ("schema = 1\n[[gauge]\n" + EDGE, ["TOML"]),
        ("schema = 1\n[gauge]\n" + EDGE, ["[[gauge]]"]),
        ("schema = 1\nunits = 3\n[[gauge]]\n" + EDGE, ["units"]),
        (f"schema = 1\n[[gauge]]\n{EDGE}[[gauge]]\n{EDGE}", ["'a'", "unique", "line 10"]),
        (_with("kind", 'kind = "egde"'), ["kind", "edge"]),
        (_with("kind", "kind = 3"), ["kind", "3"]),
        (_with("kind", ""), ["kind"]),
        (_with("name", 'name = ""'), ["name"]),
        (_with("name", 'name = "a\\nb"'), ["name"]),
        (_with("name", "name = 7"), ["name", "7"]),
        (_with("x_px", "x_px = nan"), ["x_px", "nan"]),
        (_with("x_px", "x_px = inf"), ["x_px", "inf"]),
        (_with("x_px", "x_px = 1e300"), ["x_px", "1e+300"]),
        (_with("x_px", 'x_px = "10"'), ["x_px", "10"]),
        (_with("x_px", "x_px = true"), ["x_px", "True"]),
        (_with("x_px", ""), ["x_px"]),
        (_with("length_px", "length_px = -3"), ["length_px", "-3"]),
        (_with("length_px", "length_px = 0"), ["length_px"]),
        (_with("reach_px", "reach_px = 1e9"), ["reach_px"]),
        (_with("polarity", 'polarity = "up"'), ["polarity", "rising"]),
        (_with("lenght_px", "lenght_px = 3"), ["lenght_px", "length_px"]),
        (_with("direction_deg", "direction_deg = 1e5"), ["direction_deg"]),
    ],
)
def test_what_cannot_be_meant_is_said_in_a_sentence(tmp_path: Path, text: str, facts: list[str]) -> None:
    with pytest.raises(DataError) as refused:
        _read(tmp_path, text)
    for fact in facts:
        assert fact in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="no gauge file"):
        read_gauges(tmp_path / "gauges.toml")


def test_a_gauge_that_is_larger_than_the_frame_is_refused(tmp_path: Path) -> None:
    gauges = _read(tmp_path, _with("length_px", "length_px = 5000"))
    with pytest.raises(DataError, match=r"'a'.*640x480.*length_px is 5000"):
        check_gauges(gauges, 640, 480)


def test_every_kind_says_what_it_reads_and_gives() -> None:
    assert {"gap", "edge", "pair", "line"} <= set(kinds())
    for name in kinds():
        kind = kind_named(name)
        assert {"x_px", "y_px"} <= set(names_of(kind.SPEC))
        assert kind.QUANTITIES
        assert all(sort in ("length", "angle") for _, sort in kind.QUANTITIES)
