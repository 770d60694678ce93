"""Results of an inspection as text and as data for other programs."""

from dataclasses import asdict
from typing import Any

from fingervision.domain.status import Status
from fingervision.inspection.catalogue import doubts, to_mend
from fingervision.inspection.finding import Finding, Severity
from fingervision.inspection.sample import Sample

NOTHING = "Nothing to mend: every limit that was examined costs less than the uncertainty of a good set-up."
LIGHTS = {Severity.GOOD: "good", Severity.FAIR: "FAIR", Severity.POOR: "POOR"}


def as_json(sample: Sample, findings: list[Finding]) -> dict[str, Any]:
    """Return the inspection as data that JSON can represent.

    Parameters
    ----------
    sample : Sample
        The inspected frames.
    findings : list of Finding
        Findings, the most severe first.
    """
    mend = to_mend(findings)
    gap_px = sample.track[:, 2] - sample.track[:, 1]
    return {
        "schema": 1,
        "recording": sample.description.name,
        "frames": sample.frames,
        "counts": {status.value: sample.counts[status] for status in Status if sample.counts[status]},
        "px_per_mm": None if sample.scale is None else sample.scale.px_per_mm,
        "median_gap_px": sample.median(gap_px) if len(gap_px) else None,
        "median_u_gap_px": sample.median(look.outcome.u_gap_px for look in sample.looks) if sample.looks else None,
        "response": sample.settings.response.name,
        "nothing_to_mend": not mend,
        "not_known": [finding.name for finding in doubts(findings)],
        "worst": mend[0].name if mend else None,
        "findings": [{**asdict(finding), "severity": finding.severity.value} for finding in findings],
    }


def as_text(sample: Sample, findings: list[Finding]) -> str:
    """Return the inspection as text: the most severe finding first, each with its cost and the remedy."""
    mend = to_mend(findings)
    lines = [_head(sample), ""]
    for number, finding in enumerate(mend, start=1):
        cost = "no number" if finding.cost_px is None else _cost(finding)
        lines += [
            f"{number}. {finding.name} ({LIGHTS[finding.severity]}, {cost})",
            f"   {finding.figure}",
            f"   {finding.remedy}",
        ]
    if not mend:
        lines.append(NOTHING)
    for finding in doubts(findings):
        lines += [
            "",
            f"Not known: {finding.name} (expected {_cost(finding)})",
            f"   {finding.figure}",
            f"   {finding.remedy}",
        ]
    good = [finding for finding in findings if finding.severity is Severity.GOOD]
    if good:
        lines += ["", "In order:"]
        lines += [f"   {finding.name:<13} {_cost(finding):>18}   {finding.figure}" for finding in good]
    return "\n".join(lines)


def _head(sample: Sample) -> str:
    if not sample.looks:
        return f"{sample.frames} frames of {sample.description.name} were inspected; none has a gap."
    m = sample.looks[len(sample.looks) // 2].outcome
    gap = f"{m.gap_px:.2f} px" if sample.scale is None else f"{m.gap_px / sample.scale.px_per_mm:.4f} mm"
    return (
        f"{sample.frames} frames of {sample.description.name} were inspected; the gap is {gap}; its standard "
        f"uncertainty from frame to frame is {m.u_gap_px:.3f} px."
    )


def _cost(finding: Finding) -> str:
    if finding.cost_um is None:
        return f"{finding.cost_px or 0.0:.3f} px"
    return f"{finding.cost_um:.2f} µm"
