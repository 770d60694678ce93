"""Nominal stress in the hinges of a frame: bending and tension of the section that the joints' loads pass through.

At the surface of a notch the stress is a few per cent higher than in a straight bar (plane stress gives 19.07 MPa/mm on
the paper's sample, where t / R = 0.25); beam theory has no more to say.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import PeakStress
from fingervision.models.notch import notch_of
from fingervision.models.skeleton import Skeleton

Array = NDArray[np.float64]

_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])


def peak_hinge_stress(gripper: Gripper, skeleton: Skeleton, displacement: Array) -> PeakStress:
    """Find the largest nominal stress, |N| / (b h) + 6 |M| / (b h^2), over the joints between a hinge's segments.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    skeleton : Skeleton
        Its tree of members, hinges cut into an even number of segments: their middle, the thinnest section, is a joint.
    displacement : ndarray of float, shape (3 * (members + 1),)
        Displacements (mm) and rotations (rad) by 1 mm of input, joint by joint, the clamp first.

    Returns
    -------
    PeakStress
        On the side of the section that both loads stretch or press alike.
    """
    notch = notch_of(gripper)
    moved = displacement.reshape(-1, 3)
    centres = {"hinge 1": gripper.lever.hinge1_mm, "hinge 2": gripper.lever.hinge2_mm}
    peak = PeakStress(0.0, gripper.lever.hinge1_mm)
    for place, member in enumerate(skeleton.members):
        if member.name not in centres:
            continue
        start, end = np.array(member.start_mm), np.array(member.end_mm)
        along = (end - start) / np.hypot(*(end - start))
        axes = np.array([along, [-along[1], along[0]]])
        first, second = moved[member.parent + 1], moved[place + 1]
        # The end's motion as the start's rigid motion leaves it.
        carried = first[:2] + first[2] * np.array([start[1] - end[1], end[0] - start[0]])
        strained = np.append(axes @ (second[:2] - carried), second[2] - first[2])
        tension_n, _, moment_n_mm = np.linalg.solve(member.compliance[_PLANAR], strained)
        height_mm = float(notch.height_mm(np.array([along @ (end - np.array(centres[member.name]))]))[0])
        bending = 6.0 * abs(moment_n_mm) / (notch.plate_mm * height_mm**2)
        stress = abs(tension_n) / (notch.plate_mm * height_mm) + bending
        if stress > peak.mpa_per_mm:
            side = np.sign(tension_n) * np.sign(moment_n_mm) or 1.0
            x, y = end - 0.5 * side * height_mm * axes[1]
            peak = PeakStress(float(stress), (float(x), float(y)))
    return peak
