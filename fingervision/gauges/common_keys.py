"""Settings (TOML keys) that several kinds of gauges share, with their limits and the reasons for the limits."""

from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field

# Largest coordinate, larger than the frames of any camera; a larger value is a typing error.
FARTHEST_PX = 100_000.0
# Smallest length, because an edge is fitted in eight pieces of at least a pixel; largest length, longer than any frame.
SHORTEST_EDGE_PX, LONGEST_PX = 8.0, 20_000.0
# Default and largest distance from the position in the previous frame at which an object is searched.
REACH_PX, LARGEST_REACH_PX = 12.0, 200.0
POLARITIES = {"any": 0, "rising": 1, "falling": -1}
"""Polarities of an edge: rising means lighter along the direction."""
MOST_DEG = 360.0

Coordinate = Annotated[
    float,
    Field("middle of the gauge in the first video frame, in the full frame", "px", low=-FARTHEST_PX, high=FARTHEST_PX),
]
Across = Annotated[
    float, Field("direction across an `edge` or `pair`: 0 right, 90 down", "degrees", low=-MOST_DEG, high=MOST_DEG)
]
Length = Annotated[
    float,
    Field(
        "length of an edge that is fitted, half of it on either side of the middle", "px",
        low=SHORTEST_EDGE_PX, high=LONGEST_PX,
    ),
]  # fmt: skip
Reach = Annotated[
    float,
    Field(
        "how far the object may move between frames; nothing similar may lie within it; 12 by default", "px",
        low=1.0, high=LARGEST_REACH_PX,
    ),
]  # fmt: skip
Polarity = Annotated[
    str, Field("of an `edge` or `line`: `any` (the default), `rising` or `falling` brightness", of=tuple(POLARITIES))
]


@dataclass(frozen=True, slots=True)
class Placed:
    """Settings of every gauge: its centre in the first frame."""

    x_px: Coordinate
    y_px: Coordinate

    @property
    def middle_px(self) -> tuple[float, float]:
        """Centre of the gauge in the first frame (pixels)."""
        return self.x_px, self.y_px
