"""Compliance of a tree of members: the sum of the members' compliances over the load paths that contain them."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.models.skeleton import Member, Skeleton
from fingervision.models.twist_transform import carried, turned

Array = NDArray[np.float64]


class ComplianceChain:
    """A tree of elastic members, clamped at its root and free elsewhere.

    Parameters
    ----------
    skeleton : Skeleton
        The members.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton

    @cached_property
    def _global(self) -> list[Array]:
        """Compliance of every member at its end, in global axes, by equation (5) of Hricko and Havlik (2015)."""
        turned_all = []
        for member in self.skeleton.members:
            angle = np.arctan2(member.end_mm[1] - member.start_mm[1], member.end_mm[0] - member.start_mm[0])
            axes = turned(float(angle))
            turned_all.append(axes @ member.compliance @ axes.T)
        return turned_all

    def path(self, member: int) -> list[int]:
        """List the members on the path from the clamp to the end of a given member."""
        path = []
        while member >= 0:
            path.append(member)
            member = self.skeleton.members[member].parent
        return path[::-1]

    @cached_property
    def _whole(self) -> Array:
        """Motion of each member's end under loads at each member's end, in 6 by 6 blocks; shape (6 n, 6 n)."""
        members = self.skeleton.members
        paths = [set(self.path(place)) for place in range(len(members))]
        total = np.zeros((6 * len(members), 6 * len(members)))
        for place, compliance in enumerate(self._global):
            if compliance.any():
                carry = np.zeros((len(members), 6, 6))
                for end in range(len(members)):
                    if place in paths[end]:
                        carry[end] = carried(_arm(members[place], members[end]))
                stacked = carry.reshape(-1, 6)
                total += stacked @ compliance @ stacked.T
        return total

    def flexibility(self, moved: int, loaded: int) -> Array:
        """Motion of one member's end under a load at another member's end: equation (12) of Hricko and Havlik (2015).

        Returns
        -------
        ndarray of float, shape (6, 6)
            The transpose is the flexibility with the two members exchanged (reciprocity theorem of Maxwell and Betti).
        """
        return self._whole[6 * moved : 6 * moved + 6, 6 * loaded : 6 * loaded + 6]


def _arm(known: Member, wanted: Member) -> Array:
    return np.array([wanted.end_mm[0] - known.end_mm[0], wanted.end_mm[1] - known.end_mm[1], 0.0])
