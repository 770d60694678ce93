"""A value with its uncertainty: the examples of JCGM 100:2008, 7.2.2 and 7.2.6, and numbers of every size."""

import pytest

from fingervision.domain.numbers import with_uncertainty


@pytest.mark.parametrize(
    ("value", "u", "words"),
    [
        (100.02147, 0.00035, "100.02147 +- 0.00035"),
        (10.05762, 0.027, "10.058 +- 0.027"),
        (28.05, 10.47, "28 +- 10"),
        (7.7196, 0.011, "7.720 +- 0.011"),
        (2.0539, 0.0996, "2.05 +- 0.10"),
        (-0.5159, 0.00075, "-0.51590 +- 0.00075"),
        (123456.0, 2345.0, "123500 +- 2300"),
        (0.0, 0.2, "0.00 +- 0.20"),
        (1.23456e-9, 3.4e-11, "1.235e-09 +- 3.4e-11"),
        (5.0, 0.0, "5 +- 0"),
        (5.0, float("inf"), "5 +- inf"),
    ],
)
def test_both_end_at_the_same_digit(value: float, u: float, words: str) -> None:
    assert with_uncertainty(value, u) == words


def test_the_sign_is_written_on_request() -> None:
    assert with_uncertainty(3.14, 0.2, "+") == "+3.14 +- 0.20"
