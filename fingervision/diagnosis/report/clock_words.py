"""Differences between opening and closing that the uncertain offset between two clocks explains."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR
from fingervision.domain.effect import Array
from fingervision.domain.report import Place

ALIKE = 0.25
"""Largest relative difference between the offsets that opening and closing require. Their mean, the only possible
offset, then leaves at most a seventh of each difference."""
STILL = 0.05
"""Share of the largest speed below which the input counts as at rest, as in the search for places."""
WAYS = {"input, opening": 1.0, "input, closing": -1.0}
"""Variables of regions that exist in one direction of the input only, with the sign of the input's speed."""


def within_clock(places: Sequence[Place], data: Observations) -> tuple[Place, ...]:
    """Add a remark to regions whose difference between opening and closing a clock offset explains.

    A clock that is late by t changes the gap by the speed of the gap times t, and so by opposite amounts for opening
    and closing. A difference is attributed to the clocks only if it is found in both directions, and if the clock
    offset that it requires is within the expanded uncertainty of the clocks.

    Parameters
    ----------
    places : sequence of Place
        Regions where measurement and model disagree.
    data : Observations
        Measurement and model.
    """
    expanded_s = COVERAGE_FACTOR * data.table.u_clock_s
    if expanded_s == 0.0 or data.chain.history.time_s is None:
        return tuple(places)
    gap_mm_s = _gap_speed(data)
    late_s = {i: _late_s(place, data, gap_mm_s) for i, place in enumerate(places)}
    # Take the largest region of each direction; the smaller ones were found after its subtraction.
    first: dict[str, tuple[int, float]] = {}
    for i, by_s in late_s.items():
        if by_s is not None and abs(by_s) <= expanded_s:
            first.setdefault(places[i].variable, (i, by_s))
    if len(first) < len(WAYS):
        return tuple(places)
    (one, by_s), (other, too_s) = first.values()
    if abs(by_s - too_s) > ALIKE * max(abs(by_s), abs(too_s)):
        return tuple(places)
    words = (
        f" (clocks {1e3 * abs(by_s + too_s) / 2.0:.2g} ms apart would cause the same difference in both directions; "
        f"the offset of the clocks has U = {1e3 * expanded_s:.2g} ms, k = 2)"
    )
    return tuple(
        replace(place, words=place.words + words) if i in (one, other) else place for i, place in enumerate(places)
    )


def _gap_speed(data: Observations) -> Array:
    """Speed (mm/s) of the predicted gap, shape (n,)."""
    return data.chain.history.rate_of(data.chain.respond({}).gap_mm)


def _late_s(place: Place, data: Observations, gap_mm_s: Array) -> float | None:
    """Offset between the clocks (s) that would explain the difference in a region; None for all other regions."""
    if place.channel != "gap" or place.variable not in WAYS:
        return None
    history = data.chain.history
    input_mm = history.input_mm
    speed = history.rate_of(input_mm)
    moves = WAYS[place.variable] * speed > STILL * np.max(np.abs(speed))
    inside = moves & (input_mm >= place.start) & (input_mm <= place.end)
    typical = float(np.median(gap_mm_s[inside])) if inside.any() else 0.0
    return None if typical == 0.0 else place.size / typical
