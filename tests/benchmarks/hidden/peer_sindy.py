"""Other method: ensemble sparse regression, E-SINDy (Fasel et al. 2022), with the optimiser of pysindy."""

import warnings
from pathlib import Path

import numpy as np

from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.peer_signatures import whiten

MODELS = 30
RIDGE = 0.05
"""Ridge parameter for columns of unit length: prevents large opposite coefficients of similar columns."""
INCLUDED = 0.6
"""Share of the ensemble above which an effect counts as named, as in the paper."""


def e_sindy(folder: Path) -> Answer:
    """Bagging of sequentially thresholded least squares; the threshold is three standard errors of a signature."""
    import pysindy

    seen = whiten(folder)
    library, r = seen.library, seen.residual
    # Only the shape with the smallest residual is used for each effect: STLSQ cannot select among hundreds of similar
    # columns.
    reach = library.columns.T @ r
    columns: list[int] = []
    owners: list[int] = []
    for j in range(len(seen.names)):
        groups = np.flatnonzero(library.owner == j)
        power = [np.sum(reach[library.first[g] : library.first[g] + library.size[g]] ** 2) for g in groups]
        g = groups[int(np.argmax(power))]
        columns += list(range(library.first[g], library.first[g] + library.size[g]))
        owners += [j] * int(library.size[g])
    spread = 1.4826 * float(np.median(np.abs(r)))
    theta, y = library.columns[:, columns], r[:, None]
    np.random.seed(0)  # noqa: NPY002 - pysindy draws its bags from the global generator
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ensemble = pysindy.EnsembleOptimizer(
            pysindy.STLSQ(threshold=3.0 * spread, alpha=RIDGE), bagging=True, n_models=MODELS
        )
        ensemble.fit(theta, y)
    share = np.mean(np.abs(np.array(ensemble.coef_list)[:, 0, :]) > 0, axis=0)
    names = frozenset(seen.names[owners[k]] for k in np.flatnonzero(share > INCLUDED))
    return Answer("named" if names else "agrees", (names,) if names else (), 0.0, {})
