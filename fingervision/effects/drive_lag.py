"""Drive lag: the mechanism follows the recorded input with a delay."""

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.effects.time_delay import delay_that_shows, late


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the mechanism follows the recorded input with a delay."""
    return late(input_mm, history, values["delay_s"])


def act_curved(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect to a stage whose position over time is curved, not linear, between the recorded inputs."""
    return late(input_mm, history, values["delay_s"], curved=True)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    return delay_that_shows(history, EFFECT.parameters[0])


EFFECT = DriveEffect(
    name="drive_lag",
    stage=Stage.DRIVE,
    order=10,
    words="the mechanism follows the recorded input with a delay",
    formula="u(t - delay_s)",
    source="a pure delay: transport in the controller and the log",
    residual="proportional to the speed, with a change of sign at each reversal; zero in holds",
    parameters=(Parameter("delay_s", "s", 0.0, 1.0, "delay of the drive", starts=8, logarithmic=True),),
    needs_times=True,
    memory=True,
    narrow=narrow,
    checks={FurtherCheck.LIGHT: False},
    delay_s=lambda values: values["delay_s"],
    act=act,
    act_curved=act_curved,
)
