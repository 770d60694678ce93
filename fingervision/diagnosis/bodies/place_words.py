"""Sentences about hinges, links and pivots: which one differs, by how much, and in which body it is visible."""

from collections.abc import Sequence

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import BodyEvidence
from fingervision.diagnosis.bodies.place_candidates import PAIRS
from fingervision.diagnosis.bodies.place_findings import Fitted
from fingervision.domain.drawing_form import DrawnPart
from fingervision.domain.numbers import with_uncertainty
from fingervision.domain.report import Place
from fingervision.models.place_answers import PlaceAnswers

COVER = 2.0
"""Coverage factor of a stated interval: 95 %."""
BINS = 8
"""Number of parts of the input's range in which a pose is compared."""
SIGNIFICANT = 5.0
"""Standard deviations above which the mean of a part is significant: by chance, in one of 17 000 tables with a hundred
parts."""
MOST = 6
"""Largest number of parts or places that a sentence lists."""


def fitted_words(fitted: Fitted) -> str:
    """Sentence on a fitted explanation, such as `right hinge 2: 14.2 +- 2.9 % too soft`."""
    candidate, size, u = fitted.candidate, fitted.size, COVER * fitted.u_stated
    where = candidate.place or candidate.name
    if candidate.part is DrawnPart.PIVOT:
        return f"{where}: {with_uncertainty(1e3 * size, 1e3 * u)} um of play"
    share = f"{with_uncertainty(100.0 * abs(size), 100.0 * u)} %"
    if candidate.part is DrawnPart.HINGE:
        return f"{where}: {share} too {'stiff' if size > 0.0 else 'soft'}"
    if candidate.part is DrawnPart.LINK:
        return f"{where}: {share} too {'long' if size > 0.0 else 'short'}, {candidate.detail}"
    if candidate.part in PAIRS:
        alike = candidate.part is DrawnPart.LINKS_ALIKE
        way, what = ("alike", "the opening is") if alike else ("oppositely", "the right finger's share is")
        return f"{where}, off {way}: {what} {share} too {'large' if size > 0.0 else 'small'}, {candidate.detail}"
    return f"{candidate.name}: {with_uncertainty(100.0 * size, 100.0 * u, '+')} %"


def set_words(members: Sequence[Fitted]) -> str:
    """Sentence with the result: one place, or the set of places that the data cannot distinguish."""
    keys = list(dict.fromkeys(member.candidate.key for member in members))
    if len(keys) == 1:
        return fitted_words(members[0])
    first = [next(m for m in members if m.candidate.key == key) for key in keys]
    return "; or ".join(fitted_words(member) for member in first)


def body_places(evidence: BodyEvidence, answers: PlaceAnswers) -> tuple[Place, ...]:
    """Find the ranges of input in which a body's pose deviates significantly, the most significant for each channel."""
    prediction, findings = evidence.prediction, evidence.findings
    u, kept = prediction.input_mm, findings.noise.kept
    found = []
    for place, name in enumerate(evidence.names):
        residual = findings.before[:, place]
        order = np.flatnonzero(kept)[np.argsort(u[kept], kind="stable")]
        parts = np.array_split(order, min(BINS, order.size))
        scores = [residual[p].sum() / (findings.noise.sd[place] * np.sqrt(p.size)) for p in parts if p.size]
        sharpest = int(np.argmax(np.abs(scores)))
        sigma = float(abs(scores[sharpest]))
        if sigma < SIGNIFICANT:
            continue
        inside = parts[sharpest]
        size = float(residual[inside].mean())
        unit = "mrad" if name.endswith("_mrad") else "mm"
        low, high = float(u[inside].min()), float(u[inside].max())
        words = (
            f"over the input, between {low:.3g} and {high:.3g} mm, {name} is {abs(size):.3g} {unit} "
            f"{'larger' if size > 0.0 else 'smaller'} than simulated, {sigma:.0f} sigma{_joined(name, answers)}"
        )
        found.append(Place(name, "input", low, high, size, unit, sigma, words))
    return tuple(sorted(found, key=lambda place: -place.sigma)[:MOST])


def _joined(channel: str, answers: PlaceAnswers) -> str:
    """Names of the hinges at the body of a channel."""
    body = channel.rpartition(".")[0]
    numbers = {each.name: number for number, each in answers.numbered_bodies().items()}
    if body not in numbers:
        return ""
    hinges = [f.name for n, f in enumerate(answers.mechanism.flexures) if numbers[body] in answers.ends(n)]
    return f" ({body} is connected to {' and '.join(hinges)})" if hinges else ""
