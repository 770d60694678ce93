"""Protocol of the operator, the person who does the manual steps of a recipe."""

from typing import Protocol


class Operator(Protocol):
    """A person at a real bed; in the simulated one it is done at once."""

    def turn_part(self) -> None:
        """Turn the part by 180 degrees in the picture."""
        ...

    def shift_picture(self) -> None:
        """Shift the camera or the part, so that the fingers stand elsewhere in the picture."""
        ...

    def put_in_slot(self, size_mm: float) -> None:
        """Put a reference slot of known width in the gripper's place, in the fingers' plane."""
        ...

    def take_out_slot(self) -> None:
        """Put the gripper back."""
        ...
