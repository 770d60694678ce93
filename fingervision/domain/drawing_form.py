"""How an effect acts in a mechanism given by its drawing, where poses of the bodies show which part differs."""

from dataclasses import dataclass
from enum import StrEnum

from fingervision.domain.parameter import Parameter


class DrawnPart(StrEnum):
    """Part of a drawing that an effect changes; a diagnosis tries every such part of the drawing."""

    HINGE = "hinge"
    """The bending stiffness of one hinge."""
    LINK = "link"
    """The length of one link: one of its ends sits off along it."""
    PIVOT = "pivot"
    """The play of one pivot."""
    LINKS_ALIKE = "links alike"
    """The lengths of a link and of its mirror image, by the same ratio."""
    LINKS_OPPOSITE = "links opposite"
    """The lengths of a link and of its mirror image, by opposite ratios."""
    INPUT = "input"
    """No place: the scale of the recorded input, and with it every channel."""
    PICTURE = "picture"
    """No place: the scale of the picture, and with it every length but no angle and no force."""
    CONSTANT = "constant"
    """No place: a constant of every channel, which is fitted beside every explanation and is no candidate."""


@dataclass(frozen=True, slots=True)
class DrawingForm:
    """Action of one effect on a drawing: what it changes there, and by how much.

    Parameters
    ----------
    part : DrawnPart
        What it changes.
    parameter : Parameter
        Its size.
    reference : float
        A size at which its signature is computed; for a pair of links it follows from that of the single link.
    """

    part: DrawnPart
    parameter: Parameter
    reference: float = 0.0
