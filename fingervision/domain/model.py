"""What the diagnosis asks of a gripper's model: input displacement in, measuring points out."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.response import Response


@runtime_checkable
class Model(Protocol):
    """A gripper that answers an input at once, without memory; memory belongs to the effects.

    Attributes
    ----------
    name : str
        How the report calls it.
    rest_gap_mm : float
        The gap g0 at input zero.
    input_range_mm : tuple of two floats
        Inputs that the model covers; measured inputs outside are refused.
    """

    @property
    def name(self) -> str:
        """How the report calls it."""
        ...

    @property
    def rest_gap_mm(self) -> float:
        """The gap at input zero."""
        ...

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input that the model covers."""
        ...

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """The measuring points for each input, centred on the model's own symmetry axis.

        Parameters
        ----------
        input_mm : ndarray of float, shape (n,)
            Positive opens. Effects may move it a little beyond `input_range_mm`: answer there by the straight line.

        Returns
        -------
        Response
            Arrays of shape (n,).
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
        """The same gripper with this effect's physics switched on; parameters are named as in the catalogue."""
        ...
