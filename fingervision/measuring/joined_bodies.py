"""Detect bodies that were mistaken for something else, because flexures could not join them where they were measured.

A flexure bends but is hardly stretched. In pure bending the chord of a flexure lies along the bisector of the
directions in which it leaves the two bodies, and is shorter than the flexure by the square of the bending angle over
24; a shear force adds a displacement across it (Howell, 2001, Compliant Mechanisms, chapter 5, ISBN 978-0-471-38478-6).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.body_poses import SeenPose
from fingervision.models.flexure import Flexure
from fingervision.models.mechanism_bodies import LinkBody

Array = NDArray[np.float64]

LONGEST, SHORTEST = 1.1, 0.6
"""Range of the ratio of a flexure's chord to its length. Polymers yield at strains of 2 to 5 %, and the ends of a
flexure on a deforming body move a few per cent differently from those on a rigid body; an arc of 3 rad has a chord of
0.66."""
MOST_ACROSS, MOST_ACROSS_NECK = 0.3, 0.1
"""Largest displacement across the chord relative to the flexure's length, for a leaf and for a notch. A leaf in a
parallel guide is displaced by up to a fifth of its length. The bending part of a notch is a third of its length, and is
displaced by up to a third of this part.
"""
SURE = 4.0
"""Number of standard uncertainties of the distance that is exceeded in 1 of 16 000 cases by chance."""


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A flexure and the two bodies that it joins, in the order of its axis."""

    flexure: Flexure
    bodies: tuple[LinkBody, LinkBody]

    def is_torn(self, poses: Mapping[str, SeenPose]) -> bool:
        """Whether the flexure cannot join the bodies at their measured poses; False if one of them was not measured."""
        half, ends, turned, variance = self.flexure.half_length_mm, [], 0.0, 0.0
        for body, along in zip(self.bodies, (-half, half), strict=True):
            pose = poses[body.name]
            if pose.x_mm is None or pose.y_mm is None or pose.angle_mrad is None or pose.random is None:
                return False
            turn = 1e-3 * pose.angle_mrad
            c, s = np.cos(turn), np.sin(turn)
            arm = np.array(self.flexure.point_mm(along, 0.0)) - body.centroid_mm
            moved = np.array([pose.x_mm + c * arm[0] - s * arm[1], pose.y_mm + s * arm[0] + c * arm[1]])
            ends.append(body.centroid_mm + moved)
            turned += 0.5 * turn
            variance += float(pose.random[0, 0] + pose.random[1, 1])
            variance += float(pose.random[2, 2]) * 1e-6 * float(arm @ arm)
        direction = np.radians(self.flexure.axis_deg) + turned
        way = np.array([np.cos(direction), np.sin(direction)])
        chord = ends[1] - ends[0]
        along, across = float(way @ chord), abs(float(way[0] * chord[1] - way[1] * chord[0]))
        length, doubt = 2.0 * half, SURE * variance**0.5
        most = (MOST_ACROSS_NECK if self.flexure.is_notch else MOST_ACROSS) * length
        return across > most + doubt or not SHORTEST * length - doubt <= along <= LONGEST * length + doubt


def torn_off(joints: Sequence[Joint], poses: Mapping[str, SeenPose]) -> set[str]:
    """Names of the bodies whose measured poses do not fit the flexures that join them to the others.

    Fixed bodies are assumed to be at their drawn positions. The moving body with the largest fraction of flexures that
    do not fit (at equal fractions, with the largest number of these flexures) is left out, repeatedly until all
    flexures of the remaining bodies fit. If two bodies are equal in both respects, it is not known which of them was
    mistaken, and both are left out.
    """
    found: set[str] = set()
    while True:
        rest = [joint for joint in joints if not found & {body.name for body in joint.bodies}]
        states = [(joint, joint.is_torn(poses)) for joint in rest]
        torn: dict[str, list[bool]] = {}
        for joint, is_torn in states:
            for body in joint.bodies:
                if not body.is_fixed:
                    torn.setdefault(body.name, []).append(is_torn)
        count = {name: (sum(own) / len(own), sum(own)) for name, own in torn.items() if any(own)}
        if not count:
            return found
        found |= {name for name, own in count.items() if own == max(count.values())}
