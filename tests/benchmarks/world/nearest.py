"""Distance of a set of effects from the truth of a table, by which sets count as equivalent.

The set is fitted, including start states, to the curve without reading noise, in units of the table's noise. The map of
position errors is linear in its curve: a spline without mean and straight line is projected out. Gains of the runs have
their prior distribution.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

from tests.benchmarks.hidden.catalogue_chain import Effects
from tests.benchmarks.world.candidates import MAP, WITH_START, Candidate, candidates
from tests.benchmarks.world.definitions import respond
from tests.benchmarks.world.rig import Array, Rig

HOPELESS = 30.0
"""Ratio of the found to the required distance above which a search is not repeated from other starting values."""
BEGINNINGS = 3
"""Number of searches for a set, from the most promising starting values."""
KNOTS_AT_REST, KNOTS_MOVING = 10, 24
"""Number of pieces of the map's spline over the travel: at rest, about the number of targets of an ISO 230-2 cycle; in
motion, eight for each of at most three periods of a simulated map, which leaves less than 1 % of its amplitude."""
EVALUATIONS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """Best fit of a set to the truth: parameters, and squared whitened distance."""

    effects: Effects
    distance: float
    start: Array


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """Computes distances for one table."""

    rig: Rig
    known: dict[str, Candidate]
    target_mm: Array
    sd_mm: Array
    map_columns: Array

    @classmethod
    def of(cls, rig: Rig) -> "Judge":
        """Prepare the computation for a table."""
        u = rig.path.input_mm[rig.path.row][rig.read]
        target = rig.clean_gap_mm[rig.read]
        span = float(np.ptp(rig.path.input_mm))
        slope = (rig.simulation.gap(u + 1e-4 * span) - rig.simulation.gap(u - 1e-4 * span)) / (2e-4 * span)
        sd = np.hypot(rig.noise_mm, slope * rig.input_error_mm)
        away = target - rig.simulation.gap(u)
        size = max(float(np.sqrt(np.mean(away**2))), rig.noise_mm)
        pieces = KNOTS_AT_REST if rig.path.at_rest else KNOTS_MOVING
        return cls(rig, candidates(rig, size), target, sd, _map_columns(u, slope, pieces, moving=not rig.path.at_rest))

    def _white(self, values: Array) -> Array:
        z = values / self.sd_mm if values.ndim == 1 else values / self.sd_mm[:, None]
        rho = self.rig.correlation
        if rho:
            z = np.concatenate([z[:1], (z[1:] - rho * z[:-1]) / np.sqrt(1 - rho**2)])
        return z

    def _nuisance(self, names: frozenset[str]) -> tuple[Array | None, Array | None]:
        spline = np.linalg.qr(self._white(self.map_columns))[0] if MAP in names else None
        gains = None
        if self.rig.run_gain:
            opening = self.target_mm - float(self.rig.simulation.gap(np.zeros(1))[0])
            run = self.rig.run[self.rig.read]
            gains = self._white(np.stack([np.where(run == k, opening, 0.0) for k in np.unique(run)], axis=1))
        return spline, gains

    def nearest(self, names: frozenset[str], begin: Effects | None = None, asked: float = np.inf) -> Nearest:
        """Fit a set; the distance is infinite if the table does not allow one of the effects.

        `begin` contains starting values; `asked` is the limit of the distance, below which the search may stop.
        """
        if not names - {MAP} <= set(self.known):
            return Nearest({}, np.inf, np.zeros(self.rig.runs))
        chosen = [c for c in self.known.values() if c.name in names]
        spline, gains = self._nuisance(names)

        def rest(effects: Effects, start: Array) -> Array:
            r = self._white(respond(self.rig, effects, start) - self.target_mm)
            if spline is not None:
                r = r - spline @ (spline.T @ r)
            if gains is not None:
                ridge = gains.T @ gains + np.eye(gains.shape[1]) / self.rig.run_gain**2
                b = np.linalg.solve(ridge, gains.T @ r)
                r = np.concatenate([r - gains @ b, b / self.rig.run_gain])
            return r

        runs = self.rig.runs
        remembered = bool(names & set(WITH_START))
        starts = [np.full(runs, s) for s in ((-0.95, 0.0, 0.95) if remembered else (0.0,))]
        tries = self._beginnings(chosen, begin, rest, starts)
        best: Nearest | None = None
        for values, start in tries:
            found = self._fit(chosen, values, start, rest, remembered)
            if best is None or found.distance < best.distance:
                best = found
            if best.distance < 1.0 or found.distance > HOPELESS * asked:
                break
        assert best is not None
        return best

    def _beginnings(self, chosen, begin, rest, starts):  # type: ignore[no-untyped-def]
        if not chosen:
            return [([], starts[0])]
        begins = [[begin[c.name]] if begin and c.name in begin else list(c.begins) for c in chosen]
        thinned = []
        for c, own in zip(chosen, begins, strict=True):
            if len(own) > 12:
                costs = [self._cost(rest, {c.name: b}, starts[0]) for b in own]
                own = [own[i] for i in np.argsort(costs)[:4]]
            thinned.append(own)
        every = [(list(values), start) for values in product(*thinned) for start in starts]
        costs = [
            self._cost(rest, {c.name: v for c, v in zip(chosen, values, strict=True)}, start) for values, start in every
        ]
        return [every[i] for i in np.argsort(costs)[:BEGINNINGS]]

    @staticmethod
    def _cost(rest, effects, start) -> float:  # type: ignore[no-untyped-def]
        r = rest(effects, start)
        return float(r @ r)

    def _fit(self, chosen, values, start, rest, remembered) -> Nearest:  # type: ignore[no-untyped-def]
        runs = self.rig.runs
        lower = np.concatenate([*(c.lower for c in chosen), -np.ones(runs if remembered else 0)])
        upper = np.concatenate([*(c.upper for c in chosen), np.ones(runs if remembered else 0)])
        x0 = np.concatenate([*values, start if remembered else np.zeros(0)])
        cuts = np.cumsum([len(c.lower) for c in chosen]).astype(int)
        names = [c.name for c in chosen]

        def split(x: Array) -> tuple[Effects, Array]:
            parts = np.split(x, cuts)
            return dict(zip(names, parts[:-1], strict=True)), parts[-1] if remembered else start

        if x0.size:
            scale = np.maximum(np.abs(x0), 1e-4 * np.minimum(upper - lower, 1.0))
            inside = np.clip(x0, lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower))
            done = least_squares(
                lambda z: rest(*split(np.clip(z * scale, lower, upper))),
                inside / scale,
                bounds=(lower / scale, upper / scale),
                max_nfev=EVALUATIONS,
                diff_step=1e-5,
                xtol=1e-8,
                ftol=1e-8,
            )
            x0 = np.clip(done.x * scale, lower, upper)
        effects, at = split(x0)
        return Nearest(effects, self._cost(rest, effects, at), at)


def _map_columns(u_mm: Array, slope: Array, pieces: int, *, moving: bool) -> Array:
    """Splines minus their straight lines over the travel or, for readings at rest, over their positions."""
    low, high = float(u_mm.min()), float(u_mm.max())
    places = np.unique(u_mm)
    if high - low < 1e-12 or places.size < 4:
        return np.zeros((u_mm.size, 1))
    if moving:
        places = np.linspace(low, high, 400)
    knots = np.concatenate([[low] * 3, np.linspace(low, high, pieces + 1), [high] * 3])

    def splines(at_mm: Array) -> Array:
        return np.asarray(BSpline.design_matrix(np.clip(at_mm, low, high), knots, 3).toarray())

    def line(at_mm: Array) -> Array:
        return np.stack([np.ones_like(at_mm), (at_mm - low) / (high - low)], axis=1)

    bent = splines(u_mm) - line(u_mm) @ np.linalg.lstsq(line(places), splines(places), rcond=None)[0]
    left, sizes, _ = np.linalg.svd(bent, full_matrices=False)
    return np.asarray(slope[:, None] * left[:, sizes > 1e-9 * sizes[0]])
