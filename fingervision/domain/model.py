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
    """A model that predicts the static gap for each input."""

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Compute the static response at each input; positive inputs open the gripper.

        Parameters
        ----------
        input_mm : ndarray of float, shape (n,)
            Displacements of the drive point.
        """
        ...


@dataclass(frozen=True, slots=True)
class PhysicalLaw:
    """Action of an effect in a model that is built from a drawing; it replaces the formula for simulation tables.

    Parameters
    ----------
    act : callable
        `act(response, history, values)` gives the points and the force after the effect, as `PointEffect.act` does.
    adds : tuple of Parameter
        Additional parameters that exist only with a drawing (such as which half was changed); they have no influence
        while the size of the effect is zero.
    foretold : mapping of str to (float, float)
        Ranges of the parameters for a gripper that agrees with its drawing; empty if the drawing predicts nothing.
    """

    act: PointAct
    adds: tuple[Parameter, ...] = ()
    foretold: Mapping[str, tuple[float, float]] = field(default_factory=lambda: MappingProxyType({}))


@runtime_checkable
class PhysicalModel(Model, Protocol):
    """A parametric gripper model in which mechanism effects act on the physics, not by the formula for tables."""

    @property
    def laws(self) -> Mapping[str, PhysicalLaw]:
        """Physical laws of effects, by the name of the effect in the catalogue."""
        ...

    @property
    def uncertain(self) -> Mapping[str, Estimate]:
        """Dimensions of the drawing with a stated uncertainty, by dotted name; a fit may vary them accordingly."""
        ...

    def redrawn(self, changes: Mapping[str, float]) -> "PhysicalModel":
        """Return the gripper with some of its dimensions changed by the given amounts, each in its own unit.

        An implementation may scale its response by the ratio of a simpler model's responses, which is accurate enough
        for derivatives.
        """
        ...

    def drawn_anew(self, changes: Mapping[str, float]) -> "PhysicalModel":
        """Return the gripper with some dimensions changed, with its response fully recomputed, which may take long."""
        ...
