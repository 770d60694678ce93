"""The image axis along which the fingers point."""

from enum import StrEnum


class Direction(StrEnum):
    """Direction in the image in which the finger tips point."""

    UP = "up"
    DOWN = "down"
    LEFT = "left"
    RIGHT = "right"

    @property
    def is_vertical(self) -> bool:
        """Whether the fingers are parallel to the image's columns (tips up or down)."""
        return self in (Direction.UP, Direction.DOWN)
