"""Effects outside the catalogue: behaviour of a set-up that no named effect describes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Foreign:
    """One effect from outside the catalogue.

    Parameters
    ----------
    name : str
        A key of `FOREIGN`.
    size_mm : float
        Amplitude on the gap, or on one edge.
    place, width : float
        Position and width, as fractions of the range of time or input.
    count : float
        Number of periods over the range, for periodic effects.
    """

    name: str
    size_mm: float
    place: float
    width: float
    count: float


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """Variables on which such an effect may depend; arrays of shape (n,) over one run's fine grid.

    Parameters
    ----------
    clock : ndarray
        Time over the whole table, from 0 to 1.
    travel : ndarray
        Input over the range, from 0 to 1.
    moving : ndarray
        Sign of the velocity, smoothed over a short distance.
    run : int
        Number of the run.
    """

    clock: Array
    travel: Array
    moving: Array
    run: int


def _step_in_time(f: Foreign, m: Moment) -> tuple[Array, Array]:
    up = (m.clock > f.place).astype(float)
    return -0.5 * f.size_mm * up, 0.5 * f.size_mm * up


def _step_of_one_edge(f: Foreign, m: Moment) -> tuple[Array, Array]:
    up = (m.clock > f.place).astype(float)
    return 0.0 * up, f.size_mm * up


def _bump_in_input(f: Foreign, m: Moment) -> tuple[Array, Array]:
    bump = np.exp(-0.5 * ((m.travel - f.place) / f.width) ** 2)
    return -0.5 * f.size_mm * bump, 0.5 * f.size_mm * bump


def _bump_of_one_edge(f: Foreign, m: Moment) -> tuple[Array, Array]:
    bump = np.exp(-0.5 * ((m.travel - f.place) / f.width) ** 2)
    return f.size_mm * bump, 0.0 * bump


def _periodic_in_time(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wave = np.sin(2 * np.pi * f.count * m.clock + 6.0 * f.place)
    return -0.5 * f.size_mm * wave, 0.5 * f.size_mm * wave


def _one_edge_periodic_in_time(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wave = np.sin(2 * np.pi * f.count * m.clock + 6.0 * f.place)
    return f.size_mm * wave, 0.0 * wave


def _square_wave_in_time(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wave = np.sign(np.sin(2 * np.pi * f.count * m.clock + 6.0 * f.place))
    return 0.5 * f.size_mm * wave, 0.5 * f.size_mm * wave


def _kink(f: Foreign, m: Moment) -> tuple[Array, Array]:
    kink = np.abs(m.travel - (0.35 + 0.3 * f.place))
    return -0.5 * f.size_mm * kink, 0.5 * f.size_mm * kink


def _notch_in_input(f: Foreign, m: Moment) -> tuple[Array, Array]:
    far = (m.travel - f.place) / f.width
    shape = -far * np.exp(0.5 * (1 - far**2))
    return -0.5 * f.size_mm * shape, 0.5 * f.size_mm * shape


def _midline_wave_in_input(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wave = np.sin(2 * np.pi * f.count / 4 * m.travel + 6.0 * f.place)
    return 0.5 * f.size_mm * wave, 0.5 * f.size_mm * wave


def _scale_by_direction(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wrong = m.moving * (m.travel - f.place) ** 2
    return -0.5 * f.size_mm * wrong, 0.5 * f.size_mm * wrong


def _slope_of_one_run(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wrong = (m.travel - 0.5) * (1.0 if m.run == 1 else 0.0)
    return -0.5 * f.size_mm * wrong, 0.5 * f.size_mm * wrong


def _ripple_that_grows(f: Foreign, m: Moment) -> tuple[Array, Array]:
    wave = m.clock * np.sin(2 * np.pi * f.count * m.clock**2)
    return -0.5 * f.size_mm * wave, 0.5 * f.size_mm * wave


FOREIGN: dict[str, Callable[[Foreign, Moment], tuple[Array, Array]]] = {
    function.__name__.lstrip("_"): function
    for function in (
        _step_in_time,
        _step_of_one_edge,
        _bump_in_input,
        _bump_of_one_edge,
        _periodic_in_time,
        _one_edge_periodic_in_time,
        _square_wave_in_time,
        _kink,
        _notch_in_input,
        _midline_wave_in_input,
        _scale_by_direction,
        _slope_of_one_run,
        _ripple_that_grows,
    )
}


def draw_foreign(rng: np.random.Generator, within_runs: list[tuple[float, float]]) -> Foreign:
    """Draw one of these effects, at a position that the runs reach.

    `within_runs` contains start and end of each run on a clock from 0 to 1. A step occurs well inside a run that is
    neither the first nor the last one; between two runs, it would only be an offset of runs.
    """
    name = str(rng.choice(list(FOREIGN)))
    place = rng.uniform(0.25, 0.75)
    if name.startswith("step"):
        start, end = within_runs[int(rng.integers(1, max(len(within_runs) - 1, 2)))]
        place = start + rng.uniform(0.3, 0.7) * (end - start)
    return Foreign(name, 1.0, place, rng.uniform(0.04, 0.12), rng.uniform(5.0, 23.0))
