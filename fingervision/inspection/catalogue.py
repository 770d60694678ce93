"""All findings, from the modules of the package `findings`, which are collected automatically."""

import importlib
import pkgutil

import fingervision.inspection.findings
from fingervision.inspection.finding import Finding, Severity
from fingervision.inspection.sample import Sample


def inspect(sample: Sample) -> list[Finding]:
    """Compute all findings (limits of the measurement) of a sample, the most severe first.

    Parameters
    ----------
    sample : Sample
        Measured frames.
    """
    package = fingervision.inspection.findings
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    found = [importlib.import_module(f"{package.__name__}.{name}").find(sample) for name in names]
    return sorted((finding for finding in found if finding is not None), key=lambda each: each.rank, reverse=True)


def to_mend(findings: list[Finding]) -> list[Finding]:
    """Findings that are certain and worth correcting, the largest cost first."""
    return [finding for finding in findings if finding.severity is not Severity.GOOD and not finding.is_doubt]


def doubts(findings: list[Finding]) -> list[Finding]:
    """Uncertain findings that would be worth correcting if they were true."""
    return [finding for finding in findings if finding.severity is not Severity.GOOD and finding.is_doubt]
