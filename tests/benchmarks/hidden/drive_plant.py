"""Effects of the drive, integrated sample by sample with formulas that differ from the catalogue's.

Every function takes the finely sampled input u (mm, shape (n,)) of one run and returns the output of that part of the
drive. The parameter `start`, from -1 to 1, is the state of a play or friction at the start of the run: -1 is the state
after upward motion.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


def late(time_s: Array, u_mm: Array, delay_s: float) -> Array:
    """Dead time, on the fine grid."""
    return np.interp(time_s - delay_s, time_s, u_mm)


def cyclic_error(u_mm: Array, amplitude_mm: float, period_mm: float, phase_rad: float) -> Array:
    """Cyclic error of a lead screw, with a small second harmonic as for real screws."""
    angle = 2 * np.pi * u_mm / period_mm + phase_rad
    return u_mm + amplitude_mm * (np.sin(angle) + 0.06 * np.sin(2 * angle + 0.7))


def stopped(u_mm: Array, lower_mm: float | None, upper_mm: float | None) -> Array:
    """An elastic end stop, beyond which the stage moves by 1 % of the commanded distance."""
    give = 0.01
    if upper_mm is not None:
        u_mm = np.where(u_mm > upper_mm, upper_mm + give * (u_mm - upper_mm), u_mm)
    if lower_mm is not None:
        u_mm = np.where(u_mm < lower_mm, lower_mm + give * (u_mm - lower_mm), u_mm)
    return u_mm


def mapped(u_mm: Array, travel_mm: tuple[float, float], heights_mm: Array) -> Array:
    """Smooth map of position errors: a natural spline minus its straight line over the travel."""
    knots = np.linspace(travel_mm[0], travel_mm[1], heights_mm.size)
    spline = CubicSpline(knots, heights_mm, bc_type="natural")
    even = np.linspace(travel_mm[0], travel_mm[1], 401)
    line = np.polyfit(even, spline(even), 1)
    inside = np.clip(u_mm, travel_mm[0], travel_mm[1])
    return np.asarray(u_mm + spline(inside) - np.polyval(line, inside))


@njit(cache=True)
def _limited(u: Array, way: float) -> Array:
    place = u[0]
    out = np.empty_like(u)
    for i in range(u.size):
        place = min(max(u[i], place - way), place + way)
        out[i] = place
    return out


def limited(time_s: Array, u_mm: Array, speed_mm_s: float) -> Array:
    """A drive with limited speed, computed step by step on the fine grid."""
    return np.asarray(_limited(u_mm, speed_mm_s * (time_s[1] - time_s[0])))


@njit(cache=True)
def _plays(u: Array, half: Array, start: float) -> Array:
    place = u[0] + start * half
    out = np.empty_like(u)
    for i in range(u.size):
        total = 0.0
        for k in range(half.size):
            if u[i] - place[k] > half[k]:
                place[k] = u[i] - half[k]
            elif place[k] - u[i] > half[k]:
                place[k] = u[i] + half[k]
            total += place[k]
        out[i] = total / half.size
    return out


def backlash(u_mm: Array, play_mm: float, start: float = 0.0) -> Array:
    """Play that engages gradually over 6 % of its width: mean of five play operators with one start state."""
    return np.asarray(_plays(u_mm, 0.5 * play_mm * np.linspace(0.97, 1.03, 5), start))


@njit(cache=True)
def _jumps(u: Array, jump: float, every: int) -> Array:
    place = u[0]
    out = np.empty_like(u)
    for i in range(u.size):
        if i % every == 0 and abs(u[i] - place) > jump:
            place = u[i]
        out[i] = place
    return out


def stick_slip(u_mm: Array, jump_mm: float, every: int) -> Array:
    """Output that sticks until the input is farther away than the jump, then follows at once; tested every `every` fine
    steps.

    If the condition were also tested between frames, the jumps would occur at other positions than by the definition,
    and the positions would diverge along a run: this would be a different effect.
    """
    return np.asarray(_jumps(u_mm, jump_mm, every))


@njit(cache=True)
def _dahl(u: Array, reach: float, steepness: float, start: float) -> Array:
    z = -start * reach
    out = np.empty_like(u)
    out[0] = z
    for i in range(1, u.size):
        du = u[i] - u[i - 1]
        parts = 8
        for _ in range(parts):
            away = z / reach if du > 0 else -z / reach
            factor = 1.0 - away
            size = abs(factor) ** steepness
            z += du / parts * (size if factor > 0 else -size)
        out[i] = z
    return out


def dahl_friction(u_mm: Array, fraction: float, reach_mm: float, start: float = 0.0) -> Array:
    """Friction model of Dahl (1968): bristles that yield smoothly, instead of eight sliders.

    `reach_mm` is the reach of the longest slider in the catalogue's model; the mean reach of its eight sliders is 9/16
    of this value.
    """
    return u_mm - fraction * np.asarray(_dahl(u_mm, 9 / 16 * reach_mm, 1.0, start))


@njit(cache=True)
def _sliders(u: Array, reach: Array, weight: Array, start: float) -> Array:
    strain = -start * reach
    out = np.zeros(u.size)
    out[0] = np.sum(weight * strain)
    for i in range(1, u.size):
        for k in range(reach.size):
            strain[k] = min(max(strain[k] + u[i] - u[i - 1], -reach[k]), reach[k])
            out[i] += weight[k] * strain[k]
    return out


def slider_friction(u_mm: Array, fraction: float, reach_mm: float, start: float = 0.0) -> Array:
    """Friction by thirteen elastic sliders of 4 to 104 % of the reach, with slightly larger weights for long ones."""
    reach = reach_mm * np.linspace(0.04, 1.04, 13)
    weight = np.linspace(0.9, 1.1, 13)
    return u_mm - fraction * np.asarray(_sliders(u_mm, reach, weight / weight.sum(), start))
