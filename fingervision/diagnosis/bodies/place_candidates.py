"""Candidate explanations: a faulty hinge, link or pivot, and effects of stage or camera with a similar signature."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import effect_key
from fingervision.domain.parameter import Parameter
from fingervision.effects import catalogue
from fingervision.models.physical_gripper import GAP
from fingervision.models.place_answers import AS_DRAWN, PlaceChanges, attachments

_MIRRORED = 1e-3
"""Largest distance between one place and the mirror image of another place at which the two are partners, as a share of
the drawing's size."""


def mirror_of(prediction: BodyPrediction) -> Callable[[str], str]:
    """Return a function that replaces names of hinges, probes and bodies in a text by those of their mirror images."""
    answers = prediction.answers
    size = answers.mechanism.region.size_mm
    at = {flexure.name: flexure.at_mm for flexure in answers.mechanism.flexures} | answers.mechanism.probes
    at |= {face.name: (0.5 * (face.box_mm[0] + face.box_mm[1]), 0.5 * (face.box_mm[2] + face.box_mm[3]))
           for face in answers.mechanism.fixed}  # fmt: skip
    at |= {body.name: (float(body.centroid_mm[0]), float(body.centroid_mm[1])) for body in answers.model.bodies}
    twins = {}
    for name, (x, y) in at.items():
        for other, (there_x, there_y) in at.items():
            if other != name and hypot(there_x + x, there_y - y) < _MIRRORED * size:
                twins[name] = other

    def mirrored(text: str) -> str:
        parts = [", ".join(sorted_pair.split(", ")) for sorted_pair in [text]]
        body, _, rest = parts[0].partition(", ")
        if not rest:
            name = body.removesuffix(" sits off")
            return twins.get(name, name) + body.removeprefix(name)
        ends = [twins.get(end, end) for end in rest.split(" to ")]
        order = sorted(ends) if all(end not in answers.mechanism.probes for end in ends) else ends
        return f"{twins.get(body, body)}, {' to '.join(order)}"

    return mirrored


def mirrored_channels(prediction: BodyPrediction) -> dict[str, tuple[str, float]]:
    """Channels whose mirror image was measured too, with the sign that relates the two channels."""
    mirrored, found = mirror_of(prediction), {}
    for name in prediction.channels:
        body, dot, part = name.rpartition(".")
        twin = f"{mirrored(body)}{dot}{part}"
        if dot and twin != name and twin in prediction.channels:
            found[name] = twin, 1.0 if part == "y_mm" else -1.0
    return found


Array = NDArray[np.float64]
Added = Callable[[float], Array]

PAIRS = (DrawnPart.LINKS_ALIKE, DrawnPart.LINKS_OPPOSITE)
"""Parts of a drawing that consist of two links changed together."""
_LEAST_SCALE = 0.05
"""Least relative change of the opening per relative change of a link's length; a link with a smaller ratio does not act
as a lever of the opening."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One candidate explanation, with one parameter: its size.

    Parameters
    ----------
    name : str
        Name of the effect in the catalogue.
    place : str
        Name of the hinge or link in the drawing; empty for an effect without a place.
    parameter : Parameter
        The parameter for the size.
    reference : float
        Size at which the signature is computed first.
    added : callable
        Maps a size to the change of every channel, shape (n, channels).
    part : DrawnPart
        Kind of part of the drawing that differs.
    detail : str
        End of a link that was moved, in words.
    changes : callable
        Maps a size to the changed quantities of the drawing; empty for a pivot and for an effect without a place.
    """

    name: str
    place: str
    parameter: Parameter
    reference: float
    added: Added
    part: DrawnPart
    detail: str = ""
    changes: Callable[[float], PlaceChanges] = lambda size: AS_DRAWN

    @property
    def key(self) -> str:
        """Name of the effect and its place, in the form used in a report: `hinge_stiffness_error@right hinge 2`."""
        return effect_key(self.name, self.place)

    @property
    def full_key(self) -> str:
        """Key as in a report, extended by the misplaced end of a link, in the form used in a `model.toml`."""
        return effect_key(self.name, self.place, self.detail)


def candidates_of(prediction: BodyPrediction) -> tuple[Candidate, ...]:
    """List candidates: effects with a place in the drawing, and effects without a place that poses can distinguish."""
    found = [*_hinges(prediction), *_links(prediction), *_pivots(prediction)]
    found += [*_pairs(prediction, found), *_without_place(prediction)]
    return tuple(found)


def _forms(*parts: DrawnPart) -> list[tuple[str, DrawingForm]]:
    """Names and forms of the effects that change a given kind of part of a drawing, in the catalogue's order."""
    forms = [(name, effect.in_drawing) for name, effect in catalogue().items()]
    return [(name, form) for name, form in forms if form is not None and form.part in parts]


def _candidate(name: str, form: DrawingForm, place: str, added: Added) -> Candidate:
    return Candidate(name, place, form.parameter, form.reference, added, form.part)


def _hinges(prediction: BodyPrediction) -> list[Candidate]:
    return [
        _candidate(name, form, flexure.name, _stiffer(prediction, number))
        for name, form in _forms(DrawnPart.HINGE)
        for number, flexure in enumerate(prediction.answers.mechanism.flexures)
    ]


def _stiffer(prediction: BodyPrediction, flexure: int) -> Added:
    return lambda ratio: prediction.changed(PlaceChanges({flexure: ratio}, {}, {}))


def _links(prediction: BodyPrediction) -> list[Candidate]:
    """Candidates for links between the hinges of a body: one end is displaced along the line through both ends.

    In a body with many flexures, links join neighbouring flexures (a minimum spanning tree).
    """
    mechanism, found = prediction.answers.mechanism, list[Candidate]()
    numbers = {flexure.name: place for place, flexure in enumerate(mechanism.flexures)}
    bodies = prediction.answers.numbered_bodies()
    for number, points in enumerate(attachments(prediction.answers)):
        body = bodies[number].name
        for one, other in _tree(points):
            for start, end in ((one, other), (other, one)):
                if end in numbers:
                    way = np.subtract(points[end], points[start])
                    place = f"{body}, {' to '.join(sorted((one, other)))}"
                    found += _link(prediction, place, f"{end} sits off", _moved(numbers[end], way))
        # A probe is linked to the nearest flexure of its body.
        for probe, at in mechanism.probes.items():
            own = [name for name in points if name in numbers]
            if own and prediction.answers.body_of_probe(probe) == number:
                start = min(own, key=lambda name: hypot(*np.subtract(at, points[name])))
                way = np.subtract(at, points[start])
                place = f"{body}, {start} to {probe}"
                found += _link(prediction, place, f"{probe} sits off", _farther(probe, way))
    return found


def _link(
    prediction: BodyPrediction, place: str, detail: str, changes: Callable[[float], PlaceChanges]
) -> list[Candidate]:
    added = _changed(prediction, changes)
    return [
        replace(_candidate(name, form, place, added), detail=detail, changes=changes)
        for name, form in _forms(DrawnPart.LINK)
    ]


def _moved(flexure: int, way: Array) -> Callable[[float], PlaceChanges]:
    return lambda ratio: PlaceChanges({}, {flexure: (float(ratio * way[0]), float(ratio * way[1]))}, {})


def _farther(probe: str, way: Array) -> Callable[[float], PlaceChanges]:
    return lambda ratio: PlaceChanges({}, {}, {probe: (float(ratio * way[0]), float(ratio * way[1]))})


def _changed(prediction: BodyPrediction, changes: Callable[[float], PlaceChanges]) -> Added:
    return lambda size: prediction.changed(changes(size))


def _tree(points: object) -> list[tuple[str, str]]:
    """Join points by lines of the smallest total length (minimum spanning tree, Prim's algorithm)."""
    places = dict(points)  # type: ignore[call-overload]
    names = list(places)
    inside, joins = names[:1], []
    while len(inside) < len(names):
        one, other = min(
            ((a, b) for a in inside for b in names if b not in inside),
            key=lambda join: hypot(*np.subtract(places[join[0]], places[join[1]])),
        )
        joins.append((one, other))
        inside.append(other)
    return joins


def _pivots(prediction: BodyPrediction) -> list[Candidate]:
    return [
        _candidate(name, form, flexure.name, _slipping(prediction, number))
        for name, form in _forms(DrawnPart.PIVOT)
        for number, flexure in enumerate(prediction.answers.mechanism.flexures)
    ]


def _slipping(prediction: BodyPrediction, flexure: int) -> Added:
    return lambda play_mm: prediction.slipped(flexure, play_mm)


def _pairs(prediction: BodyPrediction, singles: Sequence[Candidate]) -> list[Candidate]:
    """Candidates of a link and its mirror image together: equal changes alter the ratio, opposite ones the symmetry."""
    found = []
    mirrored = mirror_of(prediction)
    by_key = {(each.place, each.detail): each for each in singles if each.part is DrawnPart.LINK}
    for (place, detail), one in by_key.items():
        twin = (mirrored(place), mirrored(detail))
        if twin in by_key and (place, detail) < twin:
            other = by_key[twin]
            both = f"{place} and its mirror image"
            for name, form in _forms(*PAIRS):
                sign = 1.0 if form.part is DrawnPart.LINKS_ALIKE else -1.0
                scale = _by_length(prediction, one, other, sign)
                if abs(scale) > _LEAST_SCALE:
                    pair = _candidate(name, form, both, _together(one, other, sign, scale))
                    found.append(replace(pair, reference=scale * one.reference, detail=detail))
    return found


def _by_length(prediction: BodyPrediction, one: Candidate, other: Candidate, sign: float) -> float:
    """Change of the motion ratio, or of the asymmetry, per relative change of the lengths of both links."""
    answers = prediction.answers
    if GAP not in answers.mechanism.pairs:
        return 0.0
    drawn = prediction.linear().by_input
    changes = [each.changes(size) for each, size in ((one, one.reference), (other, sign * one.reference))]
    moved = sum(((prediction.linear(each).by_input - drawn) for each in changes), np.zeros_like(drawn))
    at = answers.channels.index
    opening = drawn[at(f"{GAP}_mm")]
    if sign > 0.0:
        return float(moved[at(f"{GAP}_mm")] / opening / one.reference)
    middle = 0.5 * sum(float(moved[at(f"{probe}_x_mm")]) for probe in answers.mechanism.pairs[GAP])
    return middle / float(opening) / one.reference


def _together(one: Candidate, other: Candidate, sign: float, scale: float) -> Added:
    return lambda size: one.added(size / scale) + other.added(sign * size / scale)


def _without_place(prediction: BodyPrediction) -> list[Candidate]:
    """Candidates without a place in the drawing: errors of the recorded input and of the picture's scale."""
    is_mm = np.array([name.endswith("_mm") for name in prediction.channels])
    added: dict[DrawnPart, Added] = {
        DrawnPart.INPUT: lambda ratio: ratio * prediction.drawn,
        DrawnPart.PICTURE: lambda ratio: ratio * prediction.drawn * is_mm,
    }
    return [_candidate(name, form, "", added[form.part]) for name, form in _forms(*added)]
