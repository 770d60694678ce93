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
    """Anything that predicts the static gap for each input."""

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
    """How an effect of the catalogue acts in a model of a drawn gripper, instead of its general formula for tables.

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
    """A parametric gripper in which a mechanism effect changes the physics, instead of the formula for tables."""

    @property
    def laws(self) -> Mapping[str, PhysicalLaw]:
        """Laws by the effect's name in the catalogue."""
        ...

    @property
    def uncertain(self) -> Mapping[str, Estimate]:
        """Dimensions of the drawing that have a stated uncertainty, by dotted name; a fit may vary them within it."""
        ...

    def redrawn(self, changes: Mapping[str, float]) -> "PhysicalModel":
        """Return the gripper with some of its dimensions changed by the given amounts, each in its own unit.

        It may take the ratio of a simpler model's answers, which is precise enough for derivatives.
        """
        ...

    def drawn_anew(self, changes: Mapping[str, float]) -> "PhysicalModel":
        """Return the same with its own answer computed anew, however long that takes."""
        ...
