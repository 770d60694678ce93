"""What tells look-alikes apart that no motion of the stage does: a sentence of advice a pair, without a promised gain.

The pairs are the exact confoundings of a straight line, and those of the camera's stage with the mechanism's.
"""

from fingervision.diagnosis.inference.hypothesis_fit import Explanation

SLOT = "measure a slot of known width in the fingers' place: what the camera adds shows in it, the gripper does not"
TURNED = "turn the part by 180 degrees in the picture: what the part does turns with it, what the camera does stays"
SHIFTED = "shift the picture: what the lens adds depends on the place in it, what the part does goes along"
EVIDENCE = {
    frozenset({"rest_gap_error", "edge_bias"}): SLOT,
    frozenset({"lever_ratio_error", "scale_error"}): SLOT,
    frozenset({"rest_gap_error", "scale_error"}): SLOT,
    frozenset({"assembly_asymmetry", "camera_tilt"}): TURNED,
    frozenset({"assembly_asymmetry", "camera_drift"}): TURNED,
    frozenset({"large_deflection", "lens_distortion"}): SHIFTED,
    frozenset({"out_of_plane_motion", "lens_distortion"}): SHIFTED,
    frozenset({"rest_gap_error", "input_offset"}): (
        "re-zero the stage: an offset that came from its zeroing changes with it, the rest gap stays"
    ),
    frozenset({"lever_ratio_error", "input_scale"}): (
        "measure the stage's travel with a gauge: the input's scale shows in it, the lever's ratio does not"
    ),
    frozenset({"drive_lag", "camera_latency"}): (
        "let the camera see a light that is switched with the drive: a late picture shows it late, a late drive in time"
    ),
    frozenset({"end_stop", "finger_contact"}): (
        "measure the force, or look at the fingers where the motion ends: fingers that meet press on each other"
    ),
}


def further_evidence(alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Say what else would tell explanations apart that differ by one effect each; a sentence a pair of effects.

    Parameters
    ----------
    alternatives : tuple of Explanation
        What the data cannot tell apart.
    """
    found: dict[frozenset[str], None] = {}
    for one in alternatives:
        for other in alternatives:
            differing = frozenset(one.names) ^ frozenset(other.names)
            if differing in EVIDENCE and len(one.names) == len(other.names):
                found[differing] = None
    return tuple(f"{' or '.join(sorted(pair))}: {EVIDENCE[pair]}." for pair in found)
