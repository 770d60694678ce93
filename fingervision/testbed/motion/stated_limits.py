"""Limits of a stage from the [actuator] section of a test bed's file, for a controller that does not report them."""

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import StageLimits

KEYS = (
    "lower_mm", "upper_mm", "speed_mm_s", "force_n", "accuracy_mm", "encoder_step_mm", "repeatability_mm", "settling_s",
)  # fmt: skip
ENDLESS_N = 1e9
"""Value used for a force limit that is not stated."""


def stated_limits(section: Section) -> StageLimits:
    """Read the settings listed in `KEYS`.

    If accuracy, encoder step, repeatability and settling time are not stated, the stage is assumed to be exact.
    """
    lower_mm = section.number("lower_mm")
    return StageLimits(
        lower_mm=lower_mm,
        upper_mm=section.number("upper_mm", above=lower_mm),
        speed_mm_s=section.number("speed_mm_s", above=0.0),
        force_n=section.number("force_n", ENDLESS_N, above=0.0),
        accuracy_mm=section.number("accuracy_mm", 0.0, low=0.0),
        encoder_step_mm=section.number("encoder_step_mm", 0.0, low=0.0),
        repeatability_mm=section.number("repeatability_mm", 0.0, low=0.0),
        settling_s=section.number("settling_s", 0.0, low=0.0),
    )
