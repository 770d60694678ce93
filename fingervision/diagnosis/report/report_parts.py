"""Report sections added by other distributions: entry points of the group `fingervision.report_parts`."""

import logging
from typing import Protocol, cast

from fingervision.diagnosis.diagnose import Diagnosis
from fingervision.domain.errors import error_words
from fingervision.plugins.faults import MisfitError
from fingervision.plugins.registry import Registry

LOG = logging.getLogger(__name__)


class ReportPart(Protocol):
    """A module, or another object, that adds a section to report.html."""

    TITLE: str

    def html(self, diagnosis: Diagnosis) -> str | None:
        """Return the section's content as HTML that loads nothing from elsewhere; None if the section is empty."""
        ...


def _held(held: object) -> dict[str, ReportPart]:
    if not isinstance(getattr(held, "TITLE", None), str) or not callable(getattr(held, "html", None)):
        lacks = "html" if isinstance(getattr(held, "TITLE", None), str) else "TITLE"
        raise MisfitError(f"A report part must have TITLE and html(diagnosis), but this one has no {lacks}")
    return {"": cast("ReportPart", held)}


def _none(name: str) -> ReportPart:
    raise KeyError(name)


REGISTRY: Registry[ReportPart] = Registry("fingervision.report_parts", "report part", lambda: (), _none, _held)


def added_sections(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Title and content of every added section; a section that fails is left out and reported."""
    sections = []
    for entry in REGISTRY.entries():
        try:
            content = entry.value.html(diagnosis)
        except Exception as error:  # a failing section must not affect the rest of the report
            LOG.warning(
                "fingervision: The report part %s of %s is left out, as it raised %s: %s.",
                entry.name, entry.origin, error_words(error), entry.origin.remedy,
            )  # fmt: skip
            continue
        if isinstance(content, str):
            sections.append((entry.value.TITLE, content))
    return sections
