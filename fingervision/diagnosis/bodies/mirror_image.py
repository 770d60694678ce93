"""Mirror images in a drawing: which bodies, hinges and channels of its two halves correspond to each other."""

from collections.abc import Callable
from math import hypot

from fingervision.diagnosis.bodies.body_prediction import BodyPrediction

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
