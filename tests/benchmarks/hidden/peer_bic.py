"""Other method: forward selection of whitened signatures by BIC (Schwarz 1978), without a verdict *unknown*."""

from pathlib import Path

import numpy as np

from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.peer_signatures import whiten

MOST = 4


def greedy_bic(folder: Path) -> Answer:
    """Add the group of signatures that reduces BIC most, until no group reduces it."""
    seen = whiten(folder)
    library, r = seen.library, seen.residual
    n = len(r)
    taken: list[int] = []
    index: list[int] = []
    best = n * np.log(r @ r / n)
    while len(taken) < MOST:
        trials = []
        for g in range(len(library.first)):
            if library.owner[g] in [library.owner[t] for t in taken]:
                continue
            now = index + list(range(library.first[g], library.first[g] + library.size[g]))
            gram = library.gram[np.ix_(now, now)] + 1e-9 * np.eye(len(now))
            reach = library.columns[:, now].T @ r
            rest = max(float(r @ r - reach @ np.linalg.solve(gram, reach)), 1e-12)
            # A shape parameter that is searched (period, reach of the sliders) counts as one more parameter.
            searched = float(np.sum(library.owner == library.owner[g]) > 1)
            trials.append((n * np.log(rest / n) + (len(now) + searched) * np.log(n), g, now))
        score, group, now = min(trials, key=lambda t: t[0])
        if score >= best:
            break
        best, index = score, now
        taken.append(group)
    names = frozenset(seen.names[library.owner[g]] for g in taken)
    return Answer("named" if names else "agrees", (names,) if names else (), 0.0, {})
