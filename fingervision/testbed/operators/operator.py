"""Protocol of the operator, the person who performs the manual steps of a recipe."""

from typing import Protocol


class Operator(Protocol):
    """Protocol of the operator: a person at a real test bed; a simulated test bed performs the steps at once."""

    def turn_part(self) -> None:
        """Turn the part by 180 degrees in the picture."""
        ...

    def shift_picture(self) -> None:
        """Shift the camera or the part, so that the fingers appear elsewhere in the picture."""
        ...

    def put_in_slot(self, size_mm: float) -> None:
        """Put a reference slot of known width in place of the gripper, in the plane of the fingers."""
        ...

    def take_out_slot(self) -> None:
        """Put the gripper back in place of the slot."""
        ...
