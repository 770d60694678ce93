"""The seam between a gripper's model and whatever asks it."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.response import Response


@runtime_checkable
class Model(Protocol):
    """Anything that predicts the gap from the input, at rest at each input."""

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Answer statically at each input; positive inputs open the gripper.

        Parameters
        ----------
        input_mm : ndarray of float, shape (n,)
            Displacement of the drive point.
        """
        ...


@runtime_checkable
class PhysicalModel(Model, Protocol):
    """A parametric gripper, where a mechanism effect is the physics itself and not the form used with a table."""

    @property
    def physics(self) -> tuple[str, ...]:
        """Names of the catalogue's mechanism effects that the model can switch on in itself."""
        ...

    def with_physics(self, name: str, values: Mapping[str, float]) -> Model:
        """Return the same gripper with this effect switched on; parameters are named as in the catalogue."""
        ...
