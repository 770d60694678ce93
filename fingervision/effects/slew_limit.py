"""Slew limit: the stage cannot move faster than its highest speed."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, Flags, History, Stage, Values
from fingervision.domain.loops import filled, loop
from fingervision.domain.parameter import Parameter

SLOWEST_SHARE, FASTEST_SHARE = 0.05, 0.98
"""Quantiles of the speeds of moving samples that are taken as the slowest and the fastest motion: samples at the ends
of strokes are slower, and errors of the recorded input make single samples appear faster."""
WINDOW, ONE_WAY = 9, 0.8
"""Number of samples over which a mean speed is computed, and fraction of the travelled distance that the net
displacement over these samples must reach."""
JUMP_RANGE = 0.01
"""Lowest speed limit that is searched with step commands, relative to the fastest commanded speed, unless the record is
so long that a slower stage still crosses the range of the input."""
APART = 1.5
"""Ratio of fastest to slowest motion above which a speed limit between the two speeds can be distinguished from a
record of a single speed with errors."""

_follow = loop("slew_limit_follow")


def follow(input_mm: Array, time_s: Array, speed_mm_s: float) -> Array:
    """Output of a stage that follows the input of one run at a speed of at most `speed_mm_s`; shape (n,).

    The computed output is exact for an input that is linear between its samples.
    """
    return filled(_follow, input_mm, np.ascontiguousarray(time_s), speed_mm_s)


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the stage follows the input at no more than its highest speed."""
    out = np.empty_like(input_mm)
    for run in history.runs:
        out[run] = follow(input_mm[run], history.times[run], values["speed_mm_s"])
    return out


def _steady_speeds(input_mm: Array, time_s: Array, jumps: Flags) -> Array:
    """Mean speeds over `WINDOW` samples of one direction; over fewer samples, encoder steps would dominate.

    `jumps`, shape (n - 1,), marks pairs of samples between which a command jumps instead of moving; windows that
    contain a jump are excluded.
    """
    if input_mm.size <= WINDOW:
        return np.zeros(0)
    net = np.abs(input_mm[WINDOW:] - input_mm[:-WINDOW])
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(input_mm)))])
    travelled = way[WINDOW:] - way[:-WINDOW]
    jumped = np.concatenate([[0], np.cumsum(jumps)])
    one_way = (net > ONE_WAY * travelled) & (net > 0.0) & (jumped[WINDOW:] == jumped[:-WINDOW])
    return np.asarray((net / (time_s[WINDOW:] - time_s[:-WINDOW]))[one_way])


def _slowest(history: History, fastest_mm_s: float) -> float:
    """Lowest speed limit to be searched with step commands: a slower stage would not cross the range in any run.

    The speed that a jump demands is its height over one sample time, so that a fixed share of it would depend on the
    sample rate.
    """
    longest_s = max(float(np.ptp(history.times[run])) for run in history.runs)
    return min(JUMP_RANGE * fastest_mm_s, history.input_span_mm / longest_s)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    if history.dwell_s > 0.0:
        return "the stage is assumed to have arrived before each reading, so that its speed has no effect"
    moving: list[Array] = []
    jumping: list[Array] = []
    for run in history.runs:
        move = np.abs(np.diff(history.input_mm[run]))
        # A move over a single sample between two rests is a step command: it demands a speed but does not show one.
        stands = np.pad(move <= 4.0 * history.input_sigma_mm, 1, constant_values=True)
        jumps = ~stands[1:-1] & stands[:-2] & stands[2:]
        jumping.append((move / np.diff(history.times[run]))[jumps])
        moving.append(_steady_speeds(history.input_mm[run], history.times[run], jumps))
    steady, asked = np.concatenate(moving), np.concatenate(jumping)
    if not steady.size and not asked.size:
        return "the input never moves between two samples"
    fastest = float(np.max(np.concatenate([steady, asked])))
    slowest, fast = _slowest(history, fastest), 0.0
    if steady.size:
        slowest, fast = np.quantile(steady, (SLOWEST_SHARE, FASTEST_SHARE))
    if max(float(fast), float(np.max(asked, initial=0.0))) < APART * slowest:
        return (
            f"the input moves at one speed only, about {fastest:.3g} mm/s: a stage with a lower limit could follow no "
            "move"
        )
    (speed_limit,) = EFFECT.parameters
    return (replace(speed_limit, lower=float(slowest), upper=fastest, neutral=fastest),)


EFFECT = DriveEffect(
    name="slew_limit",
    stage=Stage.DRIVE,
    order=56,
    words="the stage cannot move as fast as the recorded input",
    formula="follows u at most at speed_mm_s",
    source="rate limiter",
    residual="a ramp after each fast move, which vanishes once the stage has caught up",
    parameters=(
        Parameter(
            "speed_mm_s", "mm/s", 1e-6, 1e4, "highest speed of the stage", neutral=1e4, starts=12, logarithmic=True
        ),
    ),
    needs_times=True,
    memory=True,
    narrow=narrow,
    drawn_with={"speed_mm_s": 0.15},
    act=act,
)
