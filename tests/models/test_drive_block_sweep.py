"""The interpolated drive block of a sweep, compared with drawings that are computed one by one."""

import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.parameter_sweep import parse_variation, sweep_answers, varied

SAME = {0: 3e-4, 1: 2e-3, 2: 2e-3}
"""Gap per input, force, stress: tolerances, because the sweep scales the response of the meshed finger by that of its
bars."""


def test_a_sweep_of_a_block_s_length_is_that_of_its_drawings(gripper: Gripper) -> None:
    variations = [parse_variation("lever.l3_mm=17:22:12")]
    values, answers = sweep_answers(gripper, variations, HingeTheory.CORRECTED)
    for row in (1, 7):
        own = LumpedGripper(varied(gripper, variations, values[row]))
        assert answers[row, 0] == pytest.approx(own.gap_per_input, rel=SAME[0])
        assert answers[row, 1] == pytest.approx(own.force_per_input_n_mm, rel=SAME[1])
        assert answers[row, 2] == pytest.approx(own.peak_stress().mpa_per_mm, rel=SAME[2])
