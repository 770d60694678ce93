"""Gamma: the camera's transfer curve is assumed, or learnt from the shape of the edges, and was not measured."""

from fingervision.domain.camera import Origin
from fingervision.domain.frame import Coding
from fingervision.inspection.finding import Finding, weighed
from fingervision.inspection.sample import Sample

REMEDY = (
    "Switch the camera's gamma off, or measure the response (`fingervision calibrate response`) and give it to "
    "calibrate and measure with --response."
)
FORMULA = (
    "standard uncertainty of the gap due to the camera's response, as far as the shape of the edges leaves it open"
)


def find(sample: Sample) -> Finding | None:
    """State which camera response the shape of the edges shows, and what it leaves open."""
    if not sample.looks:
        return None
    response = sample.settings.camera.response
    if response.is_known:
        words = f"The camera's response is known ({response.curve.name})."
        return weighed(sample, "gamma", 0.0, words, "", FORMULA)
    cost_px = sample.median(abs(look.outcome.u_response_px) for look in sample.looks)
    if response.words:
        figure = response.words
    elif response.origin is Origin.LEARNT:
        figure = (
            f"The shape of the edges is that of a camera with {response.curve.name} levels, with which they are "
            f"measured; what it leaves open changes the gap by {cost_px:.3f} px (standard uncertainty)."
        )
    else:
        figure = (
            f"The levels are assumed to be {response.curve.name}; another response would change the gap by "
            f"{cost_px:.2f} px (standard uncertainty)."
        )
    # Nothing is to be mended as long as linear levels are the likeliest, whatever the shape of the edges leaves open; a
    # codec that loses details also makes edges that no usual curve explains.
    is_lossy = sample.description.coding is not Coding.LOSSLESS
    is_doubt = response.curve.name == "linear" and (is_lossy or all(other.weight < 0.5 for other in response.others))
    return weighed(sample, "gamma", cost_px, figure, REMEDY, FORMULA, is_doubt=is_doubt)
