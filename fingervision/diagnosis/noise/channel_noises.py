"""Noise of every channel, estimated from repeats, from stops of the stage, or from the residual's spectrum."""

import numpy as np

from fingervision.diagnosis.noise.noise_model import LEAST_SHARE, Noise, white_noise
from fingervision.diagnosis.noise.replicates import PureError
from fingervision.diagnosis.noise.restricted_likelihood import noise_of_short_runs
from fingervision.diagnosis.noise.spectrum import LEAST_RUN, noise_by_spectrum
from fingervision.domain.effect import Array, Flags, History
from fingervision.motion.recorded_input import standing_still

FEWEST_STANDING = 60
"""Total number of samples at rest required to estimate the noise from them."""
SHORT_RUN = 60
"""Length of the longest run, in samples, below which its spectrum contains too little information on the noise."""


def channel_noises(
    history: History, parts: list[Array], aside: list[Flags], floors: list[float], degrees: int, *, explained: bool
) -> tuple[Noise, ...]:
    """Estimate every channel's noise; gap and midline come from the same pictures and have related noise.

    Parameters
    ----------
    history : History
        Runs and times.
    parts : list of ndarray of float, shape (n,)
        Residual of each channel.
    aside : list of ndarray of bool, shape (n,)
        Excluded rows of each channel.
    floors : list of float
        Smallest noise of each channel: the rounding of its last digit, or the stated uncertainty.
    degrees : int
        Number of fitted parameters.
    explained : bool
        Whether the residuals are those of an explanation.
    """
    if history.time_s is None:
        return tuple(
            white_noise(part, out, floor, degrees) for part, out, floor in zip(parts, aside, floors, strict=True)
        )
    rate_hz = 1.0 / history.sample_time_s
    together = 2 if history.both_edges and explained else 1
    groups = [slice(0, together), *(slice(k, k + 1) for k in range(together, len(parts)))]
    if max(run.stop - run.start for run in history.runs) < SHORT_RUN:
        return noise_of_short_runs(parts, history.runs, aside, floors, explained=explained)

    def over(stretches: tuple[slice, ...]) -> tuple[Noise, ...]:
        return tuple(
            noise
            for g in groups
            for noise in noise_by_spectrum(parts[g], stretches, rate_hz, aside[g], floors[g], explained=explained)
        )

    everywhere = over(history.runs)
    standing = () if explained else standing_still(history, LEAST_RUN)
    if sum(hold.stop - hold.start for hold in standing) < FEWEST_STANDING:
        return everywhere
    # Unexplained changes that follow the motion of the stage would count as noise; in holds of the stage they are
    # smaller.
    holds = over(standing)
    return holds if holds[0].total_mm < everywhere[0].total_mm else everywhere


def noises_of_repeats(errors: list[PureError], floors: list[float]) -> tuple[Noise, ...]:
    """Use the scatter of repeated readings as white noise, because readings seconds apart have independent errors.

    A variance with n degrees of freedom has the relative standard uncertainty sqrt(2 / n).
    """
    found = []
    for error, floor in zip(errors, floors, strict=True):
        sd_mm, doubt = max(error.sd_mm, floor, 1e-9), float(np.sqrt(2.0 / error.degrees))
        slow_mm = float(np.sqrt(1.0 - LEAST_SHARE)) * sd_mm if error.correlation > 0.0 else 0.0
        found.append(Noise(float(np.sqrt(sd_mm**2 - slow_mm**2)), slow_mm, error.correlation, doubt))
    return tuple(found)
