"""Numbers with a decimal comma: understood where only one reading is possible, else asked about."""

import pytest

from fingervision.domain.errors import ArgumentError
from fingervision.domain.numbers import stated_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("34,0", 34.0),
        ("0,067", 0.067),
        ("-1,5", -1.5),
        ("1.234", 1.234),
        ("1.234,5", 1234.5),
        ("1,234.5", 1234.5),
        ("12,3456", 12.3456),
        ("1,234,567", 1234567.0),
        ("1.234.567", 1234567.0),
        (" 2,5e-3 ", 0.0025),
        (",5", 0.5),
    ],
)
def test_one_reading(text: str, value: float) -> None:
    assert stated_number(text, "--px-per-mm") == value


@pytest.mark.parametrize("text", ["1,234", "-12,345"])
def test_two_readings_are_asked_about(text: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        stated_number(text, "--px-per-mm")
    assert all(fact in str(caught.value) for fact in ("--px-per-mm", text.replace(",", "."), text.replace(",", "")))


@pytest.mark.parametrize("text", ["", "wide", "1,2,3", "nan", "inf", "3 mm", "\u0661"])
def test_no_number(text: str) -> None:
    with pytest.raises(ArgumentError, match="number"):
        stated_number(text, "--px-per-mm")
