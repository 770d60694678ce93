"""Model for the diagnosis of a mechanism whose drawing names its hinges, links and bodies."""

from functools import cached_property
from math import isfinite
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, UsageError
from fingervision.domain.response import Response
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_chain import MechanismChain
from fingervision.models.mechanism_figures import MechanismModel
from fingervision.models.place_answers import PlaceAnswers

Array = NDArray[np.float64]

GAP = "gap"


@runtime_checkable
class DrawnMechanism(Protocol):
    """Protocol of a model whose drawing names its hinges, links and bodies."""

    @property
    def places(self) -> PlaceAnswers:
        """Object that predicts the gap with one hinge, link or body of the drawing changed."""
        ...


class MechanismModelOfGap:
    """Model of a mechanism that has a probe pair named `gap`, for small displacements.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    kind : str
        Kind of model that computes the gap; predictions for changed hinges, links and bodies always come from the
        lumped model.

    Raises
    ------
    FingervisionError
        If the mechanism has no probe pair named `gap`.
    """

    def __init__(self, mechanism: Mechanism, kind: str) -> None:
        self.mechanism = mechanism
        if GAP not in mechanism.pairs:
            raise DataError(
                f"{mechanism.name} must have a pair of probes called {GAP} to be compared with a measured gap, but has "
                f'{", ".join(mechanism.pairs) or "none"}: add [[pair]] name = "{GAP}" with of = [two probes].'
            )
        model: MechanismModel
        if kind == "finite_element":
            model = MechanismPlate(mechanism)
        elif kind == "stiffness_matrix":
            model = MechanismChain(mechanism)
        elif kind == "lumped":
            model = MechanismFrame(mechanism)
        else:
            raise UsageError(f"The kind of model must be finite_element, lumped or stiffness_matrix, but is {kind}.")
        self._model = model
        state = model.state(1.0)
        # Without a stress, the range is a hundredth of the size, as for a gripper whose fingers never touch.
        limit = 0.01 * mechanism.region.size_mm
        reach = mechanism.material.yield_mpa / state.stress_mpa if isfinite(state.stress_mpa) else limit
        touches = [at for at in model.touch_input_mm().values() if abs(at) < reach]
        self.input_range_mm = (
            max([-reach, *(at for at in touches if at < 0.0)]),
            min([reach, *(at for at in touches if at > 0.0)]),
        )
        first, last = mechanism.pairs[GAP]
        apart = np.subtract(mechanism.probes[last], mechanism.probes[first])
        self._rest_mm = float(np.hypot(*apart))
        way = apart / self._rest_mm
        self._left = float(np.dot(state.probes_mm[first], way))
        self._right = float(np.dot(state.probes_mm[last], way))
        self._force_n = state.force_n

    def respond(self, input_mm: Array) -> Response:
        """Compute the response for small displacements; the midline is zero at zero input."""
        u = np.asarray(input_mm, dtype=float)
        half = 0.5 * self._rest_mm
        return Response(-half + self._left * u, half + self._right * u, self._force_n * u)

    @cached_property
    def places(self) -> PlaceAnswers:
        """Object that predicts the gap with one hinge, link or body of the drawing changed."""
        return PlaceAnswers(self.mechanism, self._model if isinstance(self._model, MechanismFrame) else None)
