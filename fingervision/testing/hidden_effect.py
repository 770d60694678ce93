"""Simulate data with an effect and diagnose these data: the diagnosis must identify the effect."""

from collections.abc import Mapping

import numpy as np

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Effect, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.parameter import Parameter
from fingervision.domain.report import DiagnosisReport
from fingervision.effects import catalogue
from fingervision.interface.own_effect import added
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.testing.contract import NotApplicable, hold

NOISE_MM = 5e-4
"""Random noise of an ordinary set-up (0.02 px at 34 px/mm)."""
SHARE_OF_SIZE, SHARE_OF_SHAPE = 0.3, 0.382
"""Position of a hidden parameter between its bounds, as a fraction of the range. A parameter of size is well away from
its neutral value. A parameter of shape is at the golden section, away from the middle of its range, which is the only
starting value by default."""


def made_up_history() -> History:
    """History of the simulated data: two runs of opening and return, 400 samples in 16 s."""
    up = np.linspace(-0.45, 1.45, 100)
    run = np.concatenate([up, up[::-1]])
    u = np.concatenate([run, run])
    time_s = np.arange(u.size, dtype=np.float64) * np.float64(0.04)
    runs = (slice(0, run.size), slice(run.size, u.size))
    return History(u, time_s, runs, rest_gap_mm=4.0, opening_mm=11.2, closing_mm=3.5)


def diagnosed(name: str, values: Mapping[str, float], *, seed: int = 1) -> DiagnosisReport:
    """Simulate two noisy runs of opening and return with an effect of the catalogue, and diagnose these data.

    Parameters
    ----------
    name : str
        Name of the effect: built in, installed, or registered by `fingervision.effects.register`.
    values : mapping of str to float
        Parameter values of the effect.
    seed : int
        Seed of the random noise.
    """
    input_mm = np.array([-0.6, 1.6])
    gap_mm = 4.0 + 7.7 * input_mm
    model = TableModel("straight", input_mm, -0.5 * gap_mm, 0.5 * gap_mm)
    rng = np.random.default_rng(seed)
    history = made_up_history()
    u = history.input_mm
    seen = MeasuringChain(model, history, {}).respond({name: values})
    left_mm, right_mm = (edge + NOISE_MM * rng.standard_normal(u.size) for edge in (seen.left_mm, seen.right_mm))
    table = MeasuredTable(
        u, right_mm - left_mm, np.asarray(0.5 * (left_mm + right_mm)), history.time_s, history.runs, ("1", "2")
    )
    return diagnose(table, CorrectedModel("straight", model, "straight.csv", (-0.6, 1.6), {}), seed=seed).report


def hidden_values(effect: Effect, history: History) -> dict[str, float]:
    """Parameter values for the hidden effect, chosen away from the starting values of a search.

    Raises
    ------
    NotApplicable
        The effect cannot be detected with this motion.
    """
    searched = effect.search(history)
    if isinstance(searched, str):
        raise NotApplicable(f"{effect.name} cannot be detected with the motion of this test: {searched}")
    return {each.name: _hidden(each) for each in searched if each.run is None}


def _hidden(parameter: Parameter) -> float:
    lower, upper = parameter.lower, parameter.upper
    if parameter.neutral is not None:
        to = upper if upper > parameter.neutral else lower
        return float((1.0 - SHARE_OF_SIZE) * parameter.neutral + SHARE_OF_SIZE * to)
    if lower > 0.0:
        return float(lower * (upper / lower) ** SHARE_OF_SHAPE)
    return lower + SHARE_OF_SHAPE * (upper - lower)


class HiddenEffectContract:
    """Test that the diagnosis identifies a hidden effect.

    State the effect as `effect`, and parameter values as `values` if the default values are not suitable.

    The test takes some seconds, because it runs a complete diagnosis.
    """

    effect: Effect
    values: Mapping[str, float] | None = None

    def test_the_diagnosis_finds_it_again(self) -> None:
        """In two runs with ordinary noise, the hidden effect is named, alone or with indistinguishable effects."""
        effect = self.effect
        values = hidden_values(effect, made_up_history()) if self.values is None else dict(self.values)
        with added([] if effect.name in catalogue() else [effect]):
            report = diagnosed(effect.name, values)
        named = [" + ".join(names) for names in report.alternatives]
        shapes = [each.name for each in effect.parameters if each.neutral is None and each.starts == 1]
        advice = (
            f"give {' and '.join(shapes)} more starts, so that more than one value is tried between the bounds"
            if shapes
            else "check the bounds and neutral values of its parameters"
        )
        hold(
            any(effect.name in names for names in report.alternatives),
            f"The effect {effect.name} was hidden with "
            f"{', '.join(f'{name} = {value:.4g}' for name, value in values.items())} and must be found again, but the "
            f"diagnosis returned {report.verdict}{': ' if named else ''}{' or '.join(named)}: {advice}.",
        )
