"""Action of an effect on a drawn mechanism, if measured poses of the bodies show which part of the drawing differs."""

from dataclasses import dataclass
from enum import StrEnum

from fingervision.domain.parameter import Parameter


class DrawnPart(StrEnum):
    """Kind of part of a drawing that an effect changes; a diagnosis tries every part of this kind."""

    HINGE = "hinge"
    """The bending stiffness of one hinge."""
    LINK = "link"
    """The length of one link: one end is displaced along the link."""
    PIVOT = "pivot"
    """The play of one pivot."""
    LINKS_ALIKE = "links alike"
    """The lengths of a link and of its mirror image, changed by the same ratio."""
    LINKS_OPPOSITE = "links opposite"
    """The lengths of a link and of its mirror image, changed by opposite ratios."""
    INPUT = "input"
    """No part of the drawing: the scale of the recorded input, which affects every channel."""
    PICTURE = "picture"
    """No part of the drawing: the scale of the picture, which affects every length but no angle and no force."""
    CONSTANT = "constant"
    """No part of the drawing: a constant offset of every channel, fitted with every explanation but never named."""


@dataclass(frozen=True, slots=True)
class DrawingForm:
    """How an effect changes a drawing: the kind of part that it changes, and the parameter that states by how much.

    Parameters
    ----------
    part : DrawnPart
        Part of the drawing that the effect changes.
    parameter : Parameter
        Parameter that states the size of the change.
    reference : float
        Size of the change for which the effect's signature is computed; for a pair of links, the size follows from that
        for a single link.
    """

    part: DrawnPart
    parameter: Parameter
    reference: float = 0.0
