"""Contract tests of models that are built from the drawing of a gripper."""

import numpy as np

from fingervision.models.answer_figures import LINEAR
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import GripperModel, Kind
from fingervision.testbed.simulation.gripper import sample_gripper
from fingervision.testing.contract import hold

RELATIVE = 1e-6
"""Relative tolerance between stated figures and the model's response; both are for the same small displacements."""


class ModelContract:
    """Contract tests of one kind of model, stated as `kind`, on the drawing of the published gripper."""

    kind: Kind

    def model(self) -> GripperModel:
        """Build the model."""
        return self.kind.build(sample_gripper(), LINEAR, HingeTheory.CORRECTED)

    def test_it_has_the_name_of_its_kind(self) -> None:
        """The attribute `name` of the model equals `KIND` of its kind."""
        name = self.model().name
        hold(name == self.kind.KIND, f"The model must be named {self.kind.KIND}, as its KIND, but is named {name}.")

    def test_its_gap_at_input_zero_is_the_rest_gap(self) -> None:
        """The gap at input 0 is `rest_gap_mm`, and 0 lies in the range of inputs."""
        model = self.model()
        low, high = model.input_range_mm
        hold(
            low < 0.0 < high,
            f"The inputs of {self.kind.KIND} must extend from below 0 to above 0, but are {low, high}.",
        )
        at_rest = float(model.respond(np.zeros(1)).gap_mm[0])
        hold(
            abs(at_rest - model.rest_gap_mm) < RELATIVE * model.rest_gap_mm,
            f"{self.kind.KIND} must have its rest gap of {model.rest_gap_mm:g} mm at input 0, but has {at_rest:g} mm.",
        )

    def test_the_gap_opens_with_the_input_and_both_fingers_alike(self) -> None:
        """A gripper with a symmetric drawing opens symmetrically, and opens more for a larger input."""
        model = self.model()
        low, high = model.input_range_mm
        answer = model.respond(np.linspace(low, high, 7))
        hold(
            bool(np.all(np.diff(answer.gap_mm) > 0.0)),
            f"{self.kind.KIND} must open when the input increases, but does not.",
        )
        apart = float(np.max(np.abs(answer.left_mm + answer.right_mm)))
        hold(
            apart < RELATIVE * float(np.max(np.abs(answer.gap_mm))),
            f"{self.kind.KIND} must move both fingers by the same amount, but the midline moves by {apart:.3g} mm.",
        )

    def test_its_figures_are_those_of_its_answer(self) -> None:
        """Gap per input and stiffness agree with the slopes of the model's response."""
        model = self.model()
        figures = model.figures()
        low, high = model.input_range_mm
        answer = model.respond(np.array([low, 0.0, 0.5 * high]))
        slope = float((answer.gap_mm[2] - answer.gap_mm[1]) / (0.5 * high))
        hold(
            abs(slope - figures.gap_per_input) < RELATIVE * abs(slope),
            f"{self.kind.KIND} must have the gap per input that its figures state, {figures.gap_per_input:g}, but has "
            f"{slope:g}.",
        )
        if answer.force_n is not None:
            stiffness = float(answer.force_n[2] / (0.5 * high))
            hold(
                abs(stiffness - figures.input_stiffness_n_mm) < RELATIVE * abs(stiffness),
                f"{self.kind.KIND} must have the stiffness that its figures state, {figures.input_stiffness_n_mm:g} "
                f"N/mm, but has {stiffness:g} N/mm.",
            )
