"""A drawn gripper or mechanism for the diagnosis: its small-displacement response, and formulas for effects.

Expensive parts of the response (large rotation, contact, changed links) are computed once and interpolated, so that a
search may evaluate them thousands of times.
"""

from collections.abc import Mapping
from copy import copy
from functools import cached_property
from math import isfinite
from operator import attrgetter
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model, PhysicalLaw
from fingervision.domain.parameter import Estimate
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LINEAR
from fingervision.models.gripper_mechanism import redrawn, whole_mechanism
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import build_model
from fingervision.models.laws import laws_of
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import MECHANISM_MODELS
from fingervision.models.place_answers import PlaceAnswers
from fingervision.models.small_answer import DrawnAnswer, SmallAnswer, ratio_curves, small_answer
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper

Array = NDArray[np.float64]

_SHORTER, _LONGER = -0.26, 0.5
"""Range of relative changes of the lever's length: the amplification then changes by 30 % in either direction."""


class PhysicalGripper:
    """One kind of model of a drawn gripper, for small displacements unless an effect adds large rotation or contact.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    kind : str
        Kind of model. For changed links and hinges its response is scaled by the ratio of the `lumped` model's
        responses; large rotation and contact are computed by this kind itself.
    theory : HingeTheory
        Theory of the hinges' compliance.
    """

    def __init__(self, gripper: Gripper, kind: str, theory: HingeTheory = HingeTheory.CORRECTED) -> None:
        self.gripper, self.theory = gripper, theory
        self._model = build_model(kind, gripper, LINEAR, theory)
        self._kind = kind
        self.input_range_mm = self._model.input_range_mm
        self._drawn = self.answer = _own_answer(self._model)

    def respond(self, input_mm: Array) -> Response:
        """Compute the response for small displacements, with two identical halves."""
        answer = self.answer
        right = 0.5 * (answer.rest_gap_mm + answer.gap_per_input * np.asarray(input_mm, dtype=float))
        return Response(-right, right, answer.force_per_input_n_mm * np.asarray(input_mm, dtype=float))

    @cached_property
    def laws(self) -> Mapping[str, PhysicalLaw]:
        """Formulas for those effects of the catalogue that the drawing determines, by the name of the effect."""
        model = self._model
        if not isinstance(model, DrawnGripper):
            model = StiffnessMatrixGripper(self.gripper, theory=self.theory)
        length_mm = self.gripper.lever.l2_mm
        lever = ratio_curves(
            self.gripper,
            self.theory,
            lambda by: redrawn(self.gripper, "lever.l2_mm", by),
            *sorted((_SHORTER * length_mm, _LONGER * length_mm)),
        )
        return laws_of(DrawnAnswer(self.gripper, self.theory, model, self.input_range_mm, lever))

    @cached_property
    def places(self) -> PlaceAnswers:
        """Object that predicts changes of single hinges or links of both halves, by condensed bodies."""
        return PlaceAnswers(whole_mechanism(self.gripper, self.gripper, "gripper"))

    @property
    def uncertain(self) -> Mapping[str, Estimate]:
        """Dimensions of the drawing with a stated uncertainty, by dotted name; a fit may change them."""
        return {
            name: Estimate(attrgetter(name)(self.gripper), u)
            for name, u in self.gripper.uncertainties.items()
            if u > 0.0
        }

    def redrawn(self, changes: Mapping[str, float]) -> "PhysicalGripper":
        """Return the gripper with changed dimensions; its response is scaled by a ratio from the bar model.

        The laws are unchanged.
        """
        if not changes:
            return self._with(self._drawn)
        new, old, drawn = small_answer(self._changed(changes), self.theory), self._frame, self._drawn
        return self._with(
            SmallAnswer(
                drawn.rest_gap_mm + new.rest_gap_mm - old.rest_gap_mm,
                drawn.gap_per_input * new.gap_per_input / old.gap_per_input,
                drawn.force_per_input_n_mm * new.force_per_input_n_mm / old.force_per_input_n_mm,
            )
        )

    def drawn_anew(self, changes: Mapping[str, float]) -> "PhysicalGripper":
        """Return the gripper with changed dimensions, computed by this kind of model itself.

        The response that a bar model and fixed ratios give for the same dimensions differs by about 1e-4 (relative).
        """
        if not changes:
            return self._with(self._drawn)
        return self._with(_own_answer(build_model(self._kind, self._changed(changes), LINEAR, self.theory)))

    def _changed(self, changes: Mapping[str, float]) -> Gripper:
        gripper = self.gripper
        for name, by in changes.items():
            gripper = redrawn(gripper, name, by)
        return gripper

    def _with(self, answer: SmallAnswer) -> "PhysicalGripper":
        changed = copy(self)
        changed.laws, changed.answer = self.laws, answer
        return changed

    @cached_property
    def _frame(self) -> SmallAnswer:
        return small_answer(self.gripper, self.theory)


def _own_answer(model: Model) -> SmallAnswer:
    answer = model.respond(np.array([0.0, 1.0]))
    gap, force = answer.gap_mm, answer.force_n
    return SmallAnswer(float(gap[0]), float(gap[1] - gap[0]), 0.0 if force is None else float(force[1]))


# Model for the diagnosis of a mechanism whose drawing names its hinges, links and bodies.

GAP = "gap"
"""Name of the pair that is the fingers' gap."""


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
    followed : str
        Displacement of a body that stands for the gap, such as `lever.y_mm`; empty for the gap itself.

    Raises
    ------
    FingervisionError
        If the mechanism has no probe pair named `gap` and nothing stands for it.
    """

    def __init__(self, mechanism: Mechanism, kind: str, followed: str = "") -> None:
        self.mechanism, self.followed = mechanism, followed
        if GAP not in mechanism.pairs and not followed:
            raise DataError(
                f"{mechanism.name} must have a pair of probes called {GAP} to be compared with a measured gap, but has "
                f'{", ".join(mechanism.pairs) or "none"}: add [[pair]] name = "{GAP}" with of = [two probes].'
            )
        if kind not in MECHANISM_MODELS:
            raise UsageError(f"The kind of model must be {', '.join(MECHANISM_MODELS)}, but is {kind}.")
        model = MECHANISM_MODELS[kind](mechanism)
        self._model = model
        state, rest = model.state(1.0), model.state(0.0)
        # Without a stress, the range is a hundredth of the size, as for a gripper whose fingers never touch.
        limit = 0.01 * mechanism.region.size_mm
        reach = abs(model.input_at_yield_mm) if isfinite(state.stress_mpa) else limit
        touches = [at for at in model.touch_input_mm().values() if abs(at) < reach]
        self.input_range_mm = (
            max([-reach, *(at for at in touches if at < 0.0)]),
            min([reach, *(at for at in touches if at > 0.0)]),
        )
        if followed:
            body, _, part = followed.rpartition(".")
            at_rest, moved = (getattr(each.bodies[body], part) for each in (rest, state))
            self._rest_mm, self._right = at_rest, 0.5 * (moved - at_rest)
            self._left = -self._right
        else:
            first, last = mechanism.pairs[GAP]
            apart = np.subtract(mechanism.probes[last], mechanism.probes[first])
            self._rest_mm, way = rest.pairs_mm[GAP], apart / np.hypot(*apart)
            self._left, self._right = (
                float(np.subtract(state.probes_mm[name], rest.probes_mm[name]) @ way) for name in (first, last)
            )
        self._force_n = rest.force_n, state.force_n - rest.force_n

    def respond(self, input_mm: Array) -> Response:
        """Compute the response for small displacements; the midline is zero at zero input."""
        u = np.asarray(input_mm, dtype=float)
        half = 0.5 * self._rest_mm
        return Response(-half + self._left * u, half + self._right * u, self._force_n[0] + self._force_n[1] * u)

    @cached_property
    def places(self) -> PlaceAnswers:
        """Object that predicts the gap with one hinge, link or body of the drawing changed."""
        return PlaceAnswers(self.mechanism, self._model if isinstance(self._model, MechanismFrame) else None)
