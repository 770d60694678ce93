"""Protocol of a gripper model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import PointAct
from fingervision.domain.parameter import Estimate, Parameter
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


@dataclass(frozen=True, slots=True)
class PhysicalLaw:
    """How a drawn gripper itself obeys an effect of the catalogue, instead of the form used with a table.

    Parameters
    ----------
    act : callable
        `act(response, history, values)` gives the points and the force after the effect, as `PointEffect.act` does.
    adds : tuple of Parameter
        What the drawing knows beside the catalogue's parameters (which half was changed); shapes, that change nothing
        while the effect is at zero.
    foretold : mapping of str to (float, float)
        Ranges in which the parameters lie where the gripper is as drawn; empty where the drawing foretells nothing.
    """

    act: PointAct
    adds: tuple[Parameter, ...] = ()
    foretold: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))


@runtime_checkable
class PhysicalModel(Model, Protocol):
    """A parametric gripper, where a mechanism effect is the physics itself and not the form used with a table."""

    @property
    def laws(self) -> Mapping[str, PhysicalLaw]:
        """Laws by the effect's name in the catalogue."""
        ...

    @property
    def uncertain(self) -> Mapping[str, Estimate]:
        """Numbers of the drawing whose uncertainty is stated, by dotted name: they may be refitted within it."""
        ...

    def redrawn(self, changes: Mapping[str, float]) -> "PhysicalModel":
        """Return the gripper with some of its numbers changed by so much, each in its own unit."""
        ...
