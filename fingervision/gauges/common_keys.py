"""Settings (TOML keys) that several kinds of gauges share, with their limits and the reasons for the limits."""

from dataclasses import dataclass
from math import radians

from fingervision.storage.toml_section import Section

# Largest coordinate, larger than the frames of any camera; a larger value is a typing error.
FARTHEST_PX = 100_000.0
# Smallest length, because an edge is fitted in eight pieces of at least a pixel; largest length, longer than any frame.
SHORTEST_EDGE_PX, LONGEST_PX = 8.0, 20_000.0
# Default and largest distance from the position in the previous frame at which an object is searched.
REACH_PX, LARGEST_REACH_PX = 12.0, 200.0
POLARITIES = ("any", "rising", "falling")


def middle(section: Section) -> tuple[float, float]:
    """Read `x_px` and `y_px`: the gauge's centre in the first frame, in pixels of the full frame."""
    x, y = (section.number(key, low=-FARTHEST_PX, high=FARTHEST_PX) for key in ("x_px", "y_px"))
    return x, y


def reach(section: Section) -> float:
    """Read `reach_px`: how far the object may move between frames; no similar object may lie within this distance."""
    return section.number("reach_px", REACH_PX, low=1.0, high=LARGEST_REACH_PX)


def length(section: Section, key: str = "length_px") -> float:
    """Read `length_px`: the length of edge that is fitted, half of it on either side of the centre."""
    return section.number(key, low=SHORTEST_EDGE_PX, high=LONGEST_PX)


def angle(section: Section, key: str, default: float | None = None) -> float:
    """Read an angle in degrees, clockwise on the screen from the x axis, and return it in radians."""
    return radians(section.number(key, default, low=-360.0, high=360.0))


def polarity(section: Section) -> int:
    """Read `polarity` of an edge: +1 rising (lighter along the direction), -1 falling, 0 any."""
    word = section.word("polarity", "any", of=POLARITIES)
    return {"any": 0, "rising": 1, "falling": -1}[word]


@dataclass(frozen=True, slots=True)
class EdgeKeys:
    """Settings of a gauge that follows one straight edge.

    Parameters
    ----------
    middle_px : (float, float)
        Centre of the gauge in the first frame.
    direction_rad : float
        Direction of the gauge, from the x axis clockwise on the screen: across the edge, or along it, depending on the
        kind.
    length_px, reach_px : float
        Length of edge that is fitted, and largest motion between frames.
    polarity : int
        +1 for a rising edge (lighter along the direction), -1 for a falling edge, 0 for any edge.
    """

    middle_px: tuple[float, float]
    direction_rad: float
    length_px: float
    reach_px: float
    polarity: int


def edge_keys(section: Section, direction: str) -> tuple[tuple[float, float], float, float, float, int]:
    """Read the values of `EdgeKeys` in the order of its attributes; `direction` names the key of the direction."""
    return middle(section), angle(section, direction), length(section), reach(section), polarity(section)
