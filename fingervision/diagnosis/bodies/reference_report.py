"""Answer of a comparison with a healthy recording: sentences, data, and the drawing coloured by the evidence."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_evidence import (
    FEWEST_ROWS,
    GAP,
    LEAST_PRESENT,
    drawing_of,
    noise_floor,
    runs_among,
)
from fingervision.diagnosis.bodies.body_prediction import known_channels
from fingervision.diagnosis.bodies.healthy_reference import (
    DEGREE,
    GAIN,
    OFFSET_MM,
    SCALE,
    FittedChange,
    HealthyReference,
    Recording,
    WhatChanged,
)
from fingervision.domain.body_poses import FlexureOutline
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.numbers import with_uncertainty
from fingervision.models.corrected import CorrectedModel
from fingervision.models.place_answers import PlaceAnswers

Array = NDArray[np.float64]

SIGNIFICANT = 4.0
"""Standard uncertainties beyond which a figure of the gap changed: by chance in one of 4 000 pairs of recordings, as
four figures are compared."""
NAMES = ("rest gap", "ratio of gap to input", "bend", "reversal")


@dataclass(frozen=True, slots=True)
class GapChange:
    """Change of one figure of the gap, faulty minus healthy.

    Parameters
    ----------
    name : str
        `rest gap` (at the middle of the inputs), `ratio of gap to input`, `bend` (largest distance of the gap from a
        straight line, as a parabola), `reversal` (difference between opening and closing).
    change, u : float
        The change and its standard uncertainty, from noise and from two calibrations of the picture's scale.
    gauge : float
        Standard uncertainty in addition if the gauge of the input was set up anew between the recordings.
    unit : str
        Unit of both.
    """

    name: str
    change: float
    u: float
    gauge: float
    unit: str

    @property
    def is_significant(self) -> bool:
        """Whether the figure changed, for whatever reason."""
        return abs(self.change) > SIGNIFICANT * self.u

    @property
    def is_of_the_part(self) -> bool:
        """Whether the figure changed by more than a gauge explains that was set up anew."""
        return abs(self.change) > SIGNIFICANT * float(np.hypot(self.u, self.gauge))


def gap_changes(healthy: Recording, faulty: Recording) -> tuple[GapChange, ...]:
    """Compare the gap of two recordings, each with the gap as its only channel.

    The gap is a free polynomial of the input that both recordings share; what is left are the differences.
    """
    inputs = [one.input_mm for one in (healthy, faulty)]
    low, high = (float(end(np.concatenate(inputs))) for end in (np.min, np.max))
    half = 0.5 * (high - low)
    t = [np.asarray((u - 0.5 * (low + high)) / half, dtype=np.float64) for u in inputs]
    shared = [np.asarray(np.polynomial.legendre.legvander(one, DEGREE), dtype=np.float64) for one in t]
    timed = all(np.ptp(one.way) > 0.0 for one in (healthy, faulty))
    own = np.column_stack([np.ones_like(t[1]), t[1], t[1] ** 2 - 0.5, *([0.5 * faulty.way] if timed else [])])
    if timed:
        shared = [np.column_stack([one, 0.5 * each.way]) for one, each in zip(shared, (healthy, faulty), strict=True)]
    columns = [
        np.concatenate([healthy.noise.whitened(shared[0][:, [k]]), faulty.noise.whitened(shared[1][:, [k]])])
        for k in range(shared[0].shape[1])
    ]
    still = np.zeros((healthy.input_mm.size, 1))
    columns += [
        np.concatenate([healthy.noise.whitened(still), faulty.noise.whitened(own[:, [k]])]) for k in range(own.shape[1])
    ]
    rows = np.stack(columns, axis=1)
    measured = np.concatenate([healthy.noise.whitened(healthy.values), faulty.noise.whitened(faulty.values)])
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    inverse = np.linalg.pinv((rows / size).T @ (rows / size))
    fitted = inverse @ (rows / size).T @ measured / size
    u = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / size
    rest = measured - rows @ fitted
    excess = np.sqrt(max(1.0, float(rest @ rest) / max(measured.size - size.size, 1)))
    first = shared[0].shape[1]
    slope, middle_mm = float(np.ptp(healthy.values)) / (2.0 * half), float(np.median(np.abs(healthy.values)))
    scale, gauge = (SCALE * middle_mm, SCALE * slope, 0.0, 0.0), (OFFSET_MM * slope, GAIN * slope, 0.0, 0.0)
    factors, units = (1.0, 1.0 / half, 0.5, 1.0), ("mm", "", "mm", "mm")
    found = []
    for k in range(own.shape[1]):
        own_u = abs(factors[k]) * float(u[first + k] * excess)
        by = factors[k] * float(fitted[first + k])
        found.append(GapChange(NAMES[k], by, float(np.hypot(own_u, scale[k])), gauge[k], units[k]))
    return tuple(found)


Outlines = tuple[Mapping[str, FlexureOutline], Mapping[str, FlexureOutline]]

COVER = 2.0
"""Coverage factor of a stated interval: 95 %."""
FEWEST_OF_GAP = 12
"""Least number of rows of a gap: twice the number of coefficients of its polynomial."""
MOST_ROWS = 1500
"""Largest number of rows of a recording that are compared, evenly spaced: their noise then is a hundredth of a
reading's in any figure, less than the systematic errors."""
MANY_FRAMES = 30.0
"""Largest factor by which more frames are proposed; beyond, systematic errors do not average out."""
COLOURS = ((0.25, "#9aa5b1"), (1.0, "#c9a227"), (np.inf, "#c1440e"))
"""Colour of a flexure whose reduction of chi-square is up to a given share of the limit of a claim."""


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """A comparison with a healthy recording.

    Parameters
    ----------
    found : WhatChanged or None
        What changed in the mechanism; None if only the gap was compared.
    gap : tuple of GapChange
        Changes of the gap's figures.
    answers : PlaceAnswers or None
        The drawing.
    outlines : bool
        Whether flexures at rest were compared.
    unseen : tuple of str
        Moving bodies whose poses were not compared.
    notes : tuple of str
        Remarks that a reader must know.
    """

    found: WhatChanged | None
    gap: tuple[GapChange, ...]
    answers: PlaceAnswers | None
    outlines: bool
    unseen: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """`unchanged`, `changed` (with its places), or `place_not_told`."""
        if self.found is not None and self.found.told:
            return "changed"
        is_changed = (self.found is not None and self.found.changed) or any(one.is_of_the_part for one in self.gap)
        return "place_not_told" if is_changed else "unchanged"

    def sentences(self) -> list[str]:
        """The answer in sentences, most important first."""
        lines = [self._answer()]
        for one in self.gap:
            changed = "changed by" if one.is_significant else "did not change by more than"
            size = with_uncertainty(one.change, COVER * one.u) if one.is_significant else f"{5.0 * one.u:.2g}"
            gauge = one.is_significant and not one.is_of_the_part
            why = ", as a gauge of the input that was set up anew would change it" if gauge else ""
            lines.append(f"  gap, {one.name}: {changed} {size}{' ' if one.unit else ''}{one.unit}{why}")
        if self.found is not None:
            seen = {name: one.size for name, one in self.found.smallest.items() if np.isfinite(one.size)}
            said = [f"{name} {1e3 * size:.2g} µm" for name, size in seen.items()]
            if said:
                lines.append(f"  smallest change of thickness that would have been seen: {', '.join(said)}")
        if self.verdict != "changed" or (self.found is not None and len(self.found.places) > 1):
            lines += [f"  next: {words}" for words in [self.next_look()] if words]
        return [*lines, *(f"  note: {words}" for words in self.notes)]

    def _answer(self) -> str:
        if self.verdict == "unchanged":
            if any(one.is_significant for one in self.gap):
                return "unchanged: the recordings differ only as a gauge of the input that was set up anew would do it."
            return "unchanged: the two recordings do not differ by more than their uncertainty."
        if self.verdict == "place_not_told" or self.found is None or self.answers is None:
            return "changed, place not told: the two recordings differ, but not in a way that one place explains."
        first = [next(m for m in self.found.members if m.change.place == place) for place in self.found.places]
        said = [change_words(one, self.answers) for one in first]
        return f"changed at {said[0]}." if len(said) == 1 else f"changed at one of these places: {'; or '.join(said)}."

    def next_look(self) -> str:
        """What would tell the place; empty if nothing changed and everything was seen."""
        if self.answers is None:
            return "a drawing as the model, and measure --mechanism with it on both days, tell the place of a change."
        if not self.outlines:
            return (
                "let both recordings begin with a few frames at rest, with every flexure in view and background on "
                "both sides: measure --mechanism then writes flexures.csv, and thicknesses and places tell most faults."
            )
        if self.unseen:
            return f"measure the poses of {', '.join(self.unseen)} too."
        if self.found is not None and self.verdict == "changed" and self.found.more_frames < MANY_FRAMES:
            return f"{self.found.more_frames:.2g} times as many frames of this motion would separate these places."
        if self.verdict == "unchanged":
            return ""
        return (
            "a gauge for the input on both days, more pixels per millimetre, or the same specimen if another one was "
            "filmed, would tell; several places may have changed together."
        )

    def document(self) -> dict[str, Any]:
        """Content of changes.json."""
        found = self.found
        members = () if found is None or not found.told else found.members
        return {
            "schema": 1,
            "verdict": self.verdict,
            "places": [{"place": m.change.place, "kind": m.change.kind, "size": m.size, "u": m.u,
                        "unit": "" if m.change.kind == "stiffness" else "mm"} for m in members],
            "gap": [{"name": g.name, "change": g.change, "u": g.u, "unit": g.unit, "u_gauge": g.gauge,
                     "significant": g.is_significant} for g in self.gap],
            "smallest_thickness_change_mm": {} if found is None else {
                name: one.size if np.isfinite(one.size) else None for name, one in found.smallest.items()},
            "evidence": {} if found is None else {name: float(share) for name, share in found.by_place.items()},
            "next_look": self.next_look(),
            "notes": list(self.notes),
        }  # fmt: skip


def change_words(one: FittedChange, answers: PlaceAnswers) -> str:
    """Sentence on one change, such as `right hinge 2: 42 +-6 µm thinner (7.0 %)`."""
    size, u, place = one.size, COVER * one.u, one.change.place
    if one.change.kind == "stiffness":
        way = "stiffer" if size > 0.0 else "softer"
        return (
            f"{place}: {with_uncertainty(100.0 * abs(size), 100.0 * u)} % {way} at the same outline (material, crack)"
        )
    um = f"{with_uncertainty(1e3 * abs(size), 1e3 * u)} µm"
    if one.change.kind == "thickness":
        drawn = next(f.thickness_mm for f in answers.mechanism.flexures if f.name == place)
        return f"{place}: {um} {'thicker' if size > 0.0 else 'thinner'} ({100.0 * abs(size) / drawn:.2g} %)"
    if one.change.kind == "play":
        return f"{place}: {um} of play"
    sign = "+" if size > 0.0 else "-"
    return f"{place}: displaced {one.change.kind} its axis by {sign}{um}"


def compare_with_healthy(
    faulty: MeasuredTable, healthy: MeasuredTable, model: CorrectedModel, outlines: Outlines
) -> Compared:
    """Find what changed between two recordings of the same specimen.

    Parameters
    ----------
    faulty, healthy : MeasuredTable
        The two recordings.
    model : CorrectedModel
        A drawing, for the place of a change; with any other model only the gap is compared.
    outlines : tuple of two mappings
        Flexures at rest in the healthy and in the faulty recording, by name.

    Raises
    ------
    DataError
        A recording has too few rows.
    """
    for name, table in (("faulty", faulty), ("healthy", healthy)):
        if table.input_mm.size < FEWEST_OF_GAP or float(np.ptp(table.input_mm)) == 0.0:
            raise DataError(
                f"The {name} table must have at least {FEWEST_OF_GAP} rows with different inputs, but has "
                f"{table.input_mm.size} between {table.input_mm.min():g} and {table.input_mm.max():g} mm: record a "
                "motion."
            )
    first, second = (_recording(table, (GAP,)) for table in (healthy, faulty))
    gap = gap_changes(first, second)
    answers = drawing_of(model)
    if answers is None:
        return Compared(None, gap, None, False, (), ())
    names = _shared(answers, healthy, faulty)
    seen = set(outlines[0]) & set(outlines[1]) & {flexure.name for flexure in answers.mechanism.flexures}
    unseen = tuple(body for body in answers.moving_bodies if not any(n.startswith(f"{body}.") for n in names.values()))
    if not names and not seen:
        note = "no poses of bodies and no flexures at rest in both recordings: the place of a change cannot be told."
        return Compared(None, gap, answers, False, unseen, (note,))
    notes = []
    if not seen:
        notes.append("no flexure was seen at rest in both recordings (flexures.csv): only the motions were compared.")
    columns = (*names, *([GAP] if names and GAP in answers.channels else []))
    recordings = [_recording(table, columns) if names else None for table in (healthy, faulty)]
    channels = tuple(names.get(name, name) for name in columns)
    found = HealthyReference(answers, channels, recordings[0], recordings[1], outlines).run()
    return Compared(found, gap, answers, bool(seen), unseen, tuple(notes))


def _shared(answers: PlaceAnswers, healthy: MeasuredTable, faulty: MeasuredTable) -> dict[str, str]:
    """Poses that both tables have in most rows and that move; angles of hinges follow from those of the bodies."""
    bodies = tuple(f"{body}." for body in answers.moving_bodies)
    known = known_channels(answers, tuple(name for name in healthy.channels if name in faulty.channels))
    out = {}
    for name, drawn in known.items():
        both = [table.channels[name] for table in (healthy, faulty)]
        moves = all(one.present.mean() >= LEAST_PRESENT and np.ptp(one.value[one.present]) > 0.0 for one in both)
        if moves and drawn.startswith(bodies):
            out[name] = drawn
    return out


def _recording(table: MeasuredTable, names: tuple[str, ...]) -> Recording:
    own = [table.channels[name] for name in names if name != GAP]
    present = np.logical_and.reduce([np.ones(table.input_mm.size, dtype=bool), *(one.present for one in own)])
    rows = np.flatnonzero(present)
    if own and rows.size < FEWEST_ROWS:
        raise DataError(
            f"Each table must have {FEWEST_ROWS} rows with all of {', '.join(names)}, but one has {rows.size}: measure "
            "longer, or remove the columns that are seldom measured."
        )
    rows = rows[:: 1 + rows.size // MOST_ROWS]
    values, floors = [], []
    for name in names:
        value, u = (
            (table.gap_mm, table.u_random_mm) if name == GAP else (table.channels[name].value, table.channels[name].u)
        )
        values.append(value[rows])
        floors.append(noise_floor(value[rows], u, rows))
    runs, timed = runs_among(table.runs, rows), table.time_s is not None
    return Recording.of(table.input_mm[rows], np.stack(values, axis=1), runs, np.array(floors), timed=timed)


def drawing_svg(compared: Compared) -> str:
    """Draw the mechanism with every flexure coloured by the evidence that it changed; empty without a drawing."""
    answers, found = compared.answers, compared.found
    if answers is None or found is None:
        return ""
    shapes, corners = [], []
    for body in answers.model.bodies:
        loops = []
        for loop in (body.outline, *body.holes):
            points = np.concatenate(
                [c.at(np.linspace(c.t0, c.t1, 2 if c.is_straight else 17))[:, :-1] for c in loop.curves], axis=1
            )
            corners.append(points)
            loops.append("M" + "L".join(f"{x:.3f},{-y:.3f}" for x, y in points.T) + "Z")
        shapes.append(f'<path d="{"".join(loops)}" fill="#e4e7eb" fill-rule="evenodd" stroke="#52606d" '
                      f'vector-effect="non-scaling-stroke"><title>{escape(body.name)}</title></path>')  # fmt: skip
    every = np.concatenate(corners, axis=1)
    low, high = every.min(axis=1), every.max(axis=1)
    size = float(np.hypot(*(high - low)))
    for flexure in answers.mechanism.flexures:
        share = found.by_place.get(flexure.name, 0.0)
        colour = next(colour for limit, colour in COLOURS if share <= limit)
        (x, y), told = flexure.at_mm, found.told and flexure.name in found.places
        one = found.smallest.get(flexure.name)
        seen = "" if one is None or not np.isfinite(one.size) else f", smallest change seen {1e3 * one.size:.2g} µm"
        shapes.append(
            f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{0.018 * size:.3f}" fill="{colour}" fill-opacity="0.85" '
            f'stroke="{"#111" if told else "none"}" stroke-width="{0.005 * size:.3f}"><title>{escape(flexure.name)}: '
            f"{share:.2g} of the limit of a claim{seen}</title></circle>"
            f'<text x="{x + 0.025 * size:.3f}" y="{-y + 0.009 * size:.3f}" font-size="{0.026 * size:.3f}">'
            f"{escape(flexure.name)}</text>"
        )
    margin = 0.1 * size
    wide, tall = high - low + 2.0 * margin
    box = f"{low[0] - margin:.2f} {-high[1] - margin:.2f} {wide:.2f} {tall:.2f}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" font-family="sans-serif" role="img" '
        f'aria-label="Flexures coloured by the evidence that they changed">{"".join(shapes)}</svg>\n'
    )
