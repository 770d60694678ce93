"""Variance of fitted offset, rate and play, due to the frames' noise and the errors of the path between log rows."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.joint_fit import PLAY_STEP, information, prior_of, solve
from fingervision.measuring.clock.log_errors import DRAWS, drawn_paths
from fingervision.measuring.clock.motion_model import Alignment, Motion

CLUSTERS = 24
"""Number of stretches of the recording whose contributions are regarded as independent: the uncertainty of their
scatter is then a fifth, and a stretch of an ordinary recording contains one or two moves.
"""


def inflation(motion: Motion, at: Alignment) -> Array:
    """Ratio of the variance of offset, rate and play to the variance from the fit's own weights; shape (3,).

    The fit's weights treat the log's errors as independent from frame to frame. The true effect of the log's errors is
    computed by means of other paths that the log permits (`log_errors`): another path changes the prediction, and the
    fit passes a share of the change on to its parameters (sandwich estimator: White 1980, doi:10.2307/1912934). If the
    contributions of stretches of the recording to the parameters scatter by more than the log's errors explain, the
    scatter is used, because the gap then has causes of motion that the model lacks.
    """
    solved = solve(motion, at)
    free_play = at.play_mm > 10.0 * PLAY_STEP
    normal, jacobian = information(motion, at, solved, free_play=free_play)
    variance = solved.squares / max(solved.degrees, 1)
    frames = solved.white.size - solved.weights.size + 2
    jacobian = jacobian[:frames] / variance
    prior = prior_of(jacobian.shape[1])
    of_frames = motion.weighed(jacobian)
    expected = motion.noise.variance_mm2 * of_frames.T @ of_frames + prior
    expected_mm = motion.design(at) @ solved.weights
    for path in drawn_paths(motion.path):
        changed_mm = replace(motion, path=path).design(at) @ solved.weights - expected_mm
        pull = jacobian.T @ motion.whitened(changed_mm)
        expected += np.outer(pull, pull) / DRAWS
    clusters = min(CLUSTERS, frames // 8)
    parts = np.array_split(jacobian * solved.white[:frames, None], clusters)
    pulls = np.stack([part.sum(axis=0) for part in parts])
    seen = pulls.T @ pulls * (clusters / max(clusters - pulls.shape[1], 1)) + prior
    bread = np.linalg.pinv(normal)
    by_fit = np.maximum(np.diag(bread), 1e-300)
    ratio = np.maximum(np.diag(bread @ expected @ bread), np.diag(bread @ seen @ bread)) / by_fit
    return ratio[[0, 1, 3]] if free_play else np.array([ratio[0], ratio[1], max(ratio[0], ratio[1])])
