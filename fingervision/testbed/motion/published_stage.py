"""Limits of the stage of the published test bed (Hricko & Havlik, 2015, section 3)."""

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import StageLimits

# Stroke 10 mm, 400 mm/s, positioning accuracy +-90 um, 5.5 N.
PUBLISHED = StageLimits(lower_mm=0.0, upper_mm=10.0, speed_mm_s=400.0, force_n=5.5, accuracy_mm=0.09)
KEYS = ("lower_mm", "upper_mm", "speed_mm_s", "force_n", "accuracy_mm")


def stage_limits(section: Section) -> StageLimits:
    """Limits of a stage from its section of the configuration, with the published ones as defaults."""
    lower_mm = section.number("lower_mm", PUBLISHED.lower_mm)
    return StageLimits(
        lower_mm=lower_mm,
        upper_mm=section.number("upper_mm", PUBLISHED.upper_mm, above=lower_mm),
        speed_mm_s=section.number("speed_mm_s", PUBLISHED.speed_mm_s, above=0.0),
        force_n=section.number("force_n", PUBLISHED.force_n, above=0.0),
        accuracy_mm=section.number("accuracy_mm", PUBLISHED.accuracy_mm, low=0.0),
    )
