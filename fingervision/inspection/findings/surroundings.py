"""Structures beside the edges: a side wall in view, a soft shadow, glare, a bright rim."""

from fingervision.inspection.blocks import HEAVY
from fingervision.inspection.finding import Finding, weighed
from fingervision.inspection.findings.motion import find as motion_of
from fingervision.inspection.plateaus import plateaus
from fingervision.inspection.sample import Sample

REMEDY = (
    "Light from behind with a diffuser, and keep light off the front of the fingers; against visible side walls, use "
    "a lens of longer focal length; against glare, use paint or a mask."
)
FORMULA = (
    "u_shift_px: possible shift of the edges caused by structures beside them (vision/learnt_scene, frame_profiles, "
    "edge_profile)"
)


def find(sample: Sample) -> Finding | None:
    """Report the disturbances that the measurement found beside the edges."""
    if not sample.looks:
        return None
    cost_px = sample.u_shift_px if sample.shows_surroundings and sample.blockiness < HEAVY else 0.0
    motion = motion_of(sample)
    # Clipped levels and motion also contribute to u_shift_px, but have findings of their own.
    if plateaus(sample).is_cut or (motion is not None and (motion.cost_px or 0.0) > 0.0):
        cost_px = 0.0
    figure = f"Structures beside the edges may have changed the gap by {cost_px:.3f} px."
    return weighed(sample, "surroundings", cost_px, figure, REMEDY, FORMULA)
