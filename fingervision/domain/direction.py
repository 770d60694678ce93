"""The image axis along which the fingers point."""

from enum import StrEnum


class Direction(StrEnum):
    """Where the tips point in the image."""

    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"

    @property
    def is_vertical(self) -> bool:
        """Whether the fingers lie along the image's columns (up or down)."""
        return self in (Direction.UP, Direction.DOWN)
