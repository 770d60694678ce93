"""Differences between motor controllers: their codes on the select lines, and their response times."""

from dataclasses import dataclass

from fingervision.domain.step_data import StepData
from fingervision.storage.toml_section import Section

KEYS = ("first_code", "home_code", "home_within_s", "busy_within_s", "enable_s")
HIGHEST_CODE = 15
HOME_WITHIN_S, BUSY_WITHIN_S, ENABLE_S, LONGEST_S = 10.0, 0.5, 0.5, 60.0


@dataclass(frozen=True, slots=True)
class Codes:
    """Codes on the select lines by which the steps of the controller are selected.

    Parameters
    ----------
    first : int
        Code of step 1; the codes of the other steps follow in order.
    home : int or None
        Code for the return to the reference, if the controller has one.
    """

    first: int
    home: int | None


@dataclass(frozen=True, slots=True)
class Waits:
    """Time limits for the controller's signals.

    Parameters
    ----------
    home_s : float
        Time for the return to the reference.
    busy_s : float
        Time from the drive line to the busy line.
    enable_s : float
        Time from the enable line to readiness; 0 without an enable line.
    """

    home_s: float
    busy_s: float
    enable_s: float


def codes_of(section: Section, data: StepData) -> Codes:
    """Read the codes, which must address all steps by four lines."""
    first = section.whole("first_code", 1, low=0, high=HIGHEST_CODE)
    if first + max(data.steps) - 1 > HIGHEST_CODE:
        section.refuse(
            "first_code",
            f"must leave codes for step {max(data.steps)} on four lines (at most {HIGHEST_CODE}), but is {first}.",
        )
    if "home_code" not in section.values:
        return Codes(first, None)
    return Codes(first, section.whole("home_code", low=0, high=HIGHEST_CODE))


def waits_of(section: Section) -> Waits:
    """Read the time limits."""
    return Waits(
        section.number("home_within_s", HOME_WITHIN_S, above=0.0, high=LONGEST_S),
        section.number("busy_within_s", BUSY_WITHIN_S, above=0.0, high=LONGEST_S),
        section.number("enable_s", ENABLE_S, low=0.0, high=LONGEST_S),
    )
