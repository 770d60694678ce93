"""Keys that several kinds of gauges share, each with its limits and the reason for them."""

from dataclasses import dataclass
from math import radians

from fingervision.storage.toml_section import Section

# The largest frames that any camera makes are smaller; what lies beyond is a slip.
FARTHEST_PX = 100_000.0
# An edge is fitted in pieces along its length, each of a pixel at least; longer than a frame is a slip.
SHORTEST_EDGE_PX, LONGEST_PX = 8.0, 20_000.0
# A thing is looked for so far from where it was in the frame before.
REACH_PX, LARGEST_REACH_PX = 12.0, 200.0
POLARITIES = ("any", "rising", "falling")


def middle(section: Section) -> tuple[float, float]:
    """Read `x_px` and `y_px`: the gauge's centre in the first frame, in pixels of the full frame."""
    x, y = (section.number(key, low=-FARTHEST_PX, high=FARTHEST_PX) for key in ("x_px", "y_px"))
    return x, y


def reach(section: Section) -> float:
    """Read `reach_px`: how far the object may move from one frame to the next; nothing similar may be within it."""
    return section.number("reach_px", REACH_PX, low=1.0, high=LARGEST_REACH_PX)


def length(section: Section, key: str = "length_px") -> float:
    """Read `length_px`: the length of edge that is used, half of it to either side of the centre."""
    return section.number(key, low=SHORTEST_EDGE_PX, high=LONGEST_PX)


def angle(section: Section, key: str, default: float | None = None) -> float:
    """Read an angle in degrees, clockwise on the screen from the x axis, and return it in radians."""
    return radians(section.number(key, default, low=-360.0, high=360.0))


def polarity(section: Section) -> int:
    """Read `polarity`: +1 rising (lighter along the direction), -1 falling, 0 any."""
    word = section.word("polarity", "any", of=POLARITIES)
    return {"any": 0, "rising": 1, "falling": -1}[word]


@dataclass(frozen=True, slots=True)
class EdgeKeys:
    """Settings of a gauge that follows one straight edge.

    Parameters
    ----------
    middle_px : (float, float)
        Its centre in the first frame.
    direction_rad : float
        Its direction, from the x axis clockwise on the screen: across the edge, or along it, as the kind says.
    length_px, reach_px : float
        How much of the edge is used, and how far it may move from frame to frame.
    polarity : int
        +1 rising, -1 falling, 0 any.
    """

    middle_px: tuple[float, float]
    direction_rad: float
    length_px: float
    reach_px: float
    polarity: int


def edge_keys(section: Section, direction: str) -> tuple[tuple[float, float], float, float, float, int]:
    """Read the values of `EdgeKeys`, in its order; `direction` is the key of the direction."""
    return middle(section), angle(section, direction), length(section), reach(section), polarity(section)
