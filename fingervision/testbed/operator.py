"""The operator of a test bed: a person at the terminal, or an immediate action for a simulated camera."""

from dataclasses import replace

from fingervision.domain.errors import StateError
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.cameras.simulated import SHIFT_MM, SimulatedCamera
from fingervision.testbed.terminal import TERMINAL


class Operator:
    """The operator of a test bed: a person who receives requests on the terminal, and confirms when a step is done."""

    def turn_part(self) -> None:
        """Ask the person on the terminal to turn the part, and wait for the confirmation."""
        self._ask("Turn the part by 180 degrees in the picture.")

    def shift_picture(self) -> None:
        """Ask the person on the terminal to shift the picture, and wait for the confirmation."""
        self._ask("Shift the camera, so that the fingers appear at another place in the picture.")

    def put_in_slot(self, size_mm: float) -> None:
        """Ask the person on the terminal to insert the reference slot, and wait for the confirmation."""
        self._ask(f"Put the reference slot of {size_mm:g} mm in the plane of the fingers, in front of the camera.")

    def take_out_slot(self) -> None:
        """Ask the person on the terminal to remove the reference slot, and wait for the confirmation."""
        self._ask("Take the reference slot away, so that the camera sees the fingers again.")

    def _ask(self, words: str) -> None:
        if TERMINAL.ask(f"{words} Press Enter when it is done: ") is None:
            raise StateError(
                f"The recipe asks the operator ({words.rstrip('.').lower()}), but there is no terminal: run the "
                "command from a terminal."
            )


class AtTheSimulation(Operator):
    """Operator of a simulated test bed: the placement of the simulated part changes at once.

    Parameters
    ----------
    camera : SimulatedCamera
        The camera in front of which the part is placed.
    """

    def __init__(self, camera: SimulatedCamera) -> None:
        self._camera = camera

    def turn_part(self) -> None:
        """Turn the simulated part."""
        placed = self._camera.placed
        self._camera.place(replace(placed, turned=not placed.turned))

    def shift_picture(self) -> None:
        """Shift the simulated part, and shift it back at the next call."""
        placed = self._camera.placed
        self._camera.place(replace(placed, shift_mm=SHIFT_MM - placed.shift_mm))

    def put_in_slot(self, size_mm: float) -> None:
        """Render a slot in place of the fingers."""
        self._camera.place(replace(self._camera.placed, slot_mm=size_mm))

    def take_out_slot(self) -> None:
        """Render the fingers again."""
        self._camera.place(replace(self._camera.placed, slot_mm=None))


def operator_of(camera: BedCamera | None) -> Operator:
    """Choose the operator of a test bed according to its camera."""
    return AtTheSimulation(camera) if isinstance(camera, SimulatedCamera) else Operator()
