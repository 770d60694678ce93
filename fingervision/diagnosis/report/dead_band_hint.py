"""Describe a stage that rests away from its commanded position: the dead band of a servo."""

from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from fingervision.diagnosis.input.commands import LEAST_HOLD
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import Array, History
from fingervision.domain.report import Verdict

BY_CHANCE = 1e-3
"""Significance level: probability of the observed sides of rest if they did not depend on the side of approach."""
SHORT_SHARE = 0.8
"""Share of holds that must end short of the command: a stage that comes to rest on both sides has no dead band."""
FEWEST_IDLE = 2
"""Least number of steps without a response: a single one may be a wrong row."""
AT_REST = 3.0
"""Ratio of the distance from the command to the motion within the settled half of a hold, below which the stage is
still on its way: an exponential approach covers half of its remaining distance in that time."""
SIGMAS = 4.0
"""Distance, in standard errors of the means of two holds, above which the stage followed a step."""


def dead_band_hint(data: Observations, before_mm: Array, verdict: Verdict) -> tuple[str, ...]:
    """Sentence that the stage rests within a band about its commands, if the diagnosis found no effect for it.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    before_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted by the given model.
    verdict : Verdict
        Result of the diagnosis.
    """
    history = data.chain.history
    if verdict is not Verdict.UNKNOWN or not history.commanded:
        return ()
    gap = data.chain.stacked({})[: history.input_mm.size]
    words = band_words(history, gap, before_mm[: history.input_mm.size])
    return () if words is None else (words,)


def band_words(history: History, gap_of_input_mm: Array, residual_mm: Array) -> str | None:
    """Describe where the stage rests after each step of a command; None if there is no dead band.

    A servo with a dead band stops short of its command, on the side from which it came, or does not answer small steps.
    The mean over all holds is subtracted, because an offset is no dead band.

    Parameters
    ----------
    history : History
        Commands.
    gap_of_input_mm, residual_mm : ndarray of float, shape (n,)
        Gap that the model predicts for the commands, and measured minus predicted gap.
    """
    slope = float(np.polyfit(history.input_mm, gap_of_input_mm, 1)[0])
    steps, rests, answers, errors, creeps = _holds(
        history, residual_mm / (slope or 1.0), gap_of_input_mm / (slope or 1.0)
    )
    if steps.size < LEAST_HOLD:
        return None
    followed = np.abs(answers) > SIGMAS * errors
    idle = np.abs(steps[~followed])
    words = []
    if idle.size >= FEWEST_IDLE and float(idle.max()) < float(np.min(np.abs(steps[followed]), initial=np.inf)):
        words.append(f"{idle.size} steps of up to {idle.max():.2g} mm had no response, but all larger steps had")
    away = (rests - rests.mean())[followed] * np.sign(steps[followed])
    short = int(np.sum(away < 0.0))
    chance = binomtest(short, away.size, 0.5, alternative="greater").pvalue if away.size else 1.0
    band = float(np.median(-away[away < 0.0])) if short else 0.0
    still = AT_REST * float(np.median(np.abs(creeps[followed]))) if away.size else 0.0
    if chance < BY_CHANCE and short >= SHORT_SHARE * away.size and band > still:
        words.append(
            f"after {short} of {away.size} steps the stage stopped short of the command, on the side from which it "
            f"came, by {band:.2g} mm (median)"
        )
    if not words:
        return None
    return f"the stage comes to rest away from its commands, like a servo with a dead band: {'; '.join(words)}."


def _holds(history: History, error_mm: Array, path_mm: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Steps of the command with the settled halves of the holds before and after them; each of shape (k,), in mm.

    Returns
    -------
    steps, rests, answers, errors, creeps : ndarray of float
        Height of the step; settled distance from the command after it; change of the settled position; standard error
        of this change; change of the position from the third to the last quarter of the hold.
    """
    out: list[tuple[float, float, float, float, float]] = []
    for run in history.runs:
        borders = [run.start, *(run.start + 1 + np.flatnonzero(np.diff(history.input_mm[run]))), run.stop]
        settled = [slice(begin + (end - begin) // 2, end) for begin, end in pairwise(borders) if end - begin >= 2]
        for one, other in pairwise(settled):
            if min(one.stop - one.start, other.stop - other.start) < LEAST_HOLD // 2:
                continue
            step = float(history.input_mm[other.start] - history.input_mm[one.start])
            place = [path_mm[part] + error_mm[part] for part in (one, other)]
            scatter = float(np.sqrt(sum(np.var(part, ddof=1) / part.size for part in place)))
            answer = float(place[1].mean() - place[0].mean())
            middle = place[1].size // 2
            creep = float(place[1][middle:].mean() - place[1][:middle].mean()) if middle else 0.0
            out.append((step, float(error_mm[other].mean()), answer, scatter, creep))
    columns = np.array(out).reshape(-1, 5)
    return columns[:, 0], columns[:, 1], columns[:, 2], columns[:, 3], columns[:, 4]
