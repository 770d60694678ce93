"""In-plane natural modes of a mechanism, sorted into families, with their shapes as lines for plotting."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import UsageError
from fingervision.models.elastic_mechanism import ElasticMechanism

Array = NDArray[np.float64]
Solve = Callable[[int], tuple[Array, Array]]

MOST_MODES = 40
_SHOWN = 0.08
"""Largest displacement in a plotted mode shape, as a share of the body's height."""
_FIRST = 4
_ON_AXIS = 1e-9
"""Distance from the symmetry axis, as a share of the size, at which a line counts as lying on it."""


@dataclass(frozen=True, slots=True)
class ModesWanted:
    """Number of natural modes of each family, or the frequency (Hz) up to which they are computed."""

    count: int | None = None
    highest_hz: float = inf


@dataclass(frozen=True, slots=True, eq=False)
class ModeShape:
    """One natural mode.

    Parameters
    ----------
    family : str
        Boundary condition of the drive, and whether the two halves of a gripper move as mirror images.
    number : int
        Number of the mode, from 1.
    frequency_hz : float
        Natural frequency, undamped.
    lines_mm, shift_mm : ndarray of float, shape (n, 2, 2)
        Line pieces (start, end) of the body's outline or bars at rest, and the displacements of their ends at the
        largest plotted deflection (a mode's amplitude is arbitrary).
    swing : float
        Largest share of the displacements that can be plotted in the opposite direction: beyond it the mirrored halves
        would intersect.
    """

    family: str
    number: int
    frequency_hz: float
    lines_mm: Array
    shift_mm: Array
    swing: float = 1.0


def parse_modes(text: str) -> ModesWanted:
    """Parse the number of modes, such as `6`, or the frequency up to which they are computed, such as `500Hz`.

    Raises
    ------
    UsageError
        If the text has neither form.
    """
    bare = text.strip()
    try:
        if bare.lower().endswith("hz"):
            highest = float(bare[:-2])
            if 0.0 < highest < inf:
                return ModesWanted(None, highest)
        elif 1 <= int(bare) <= MOST_MODES:
            return ModesWanted(int(bare))
    except ValueError:
        pass
    raise UsageError(
        f"--modes must be a number from 1 to {MOST_MODES}, or a positive frequency such as 500Hz up to which all modes "
        f"are wanted, but is {text}."
    )


def mode_shapes(model: ElasticMechanism, wanted: ModesWanted) -> list[ModeShape]:
    """Modes of a mechanism with the drive free or fixed.

    Those of a mirrored drawing are symmetric; with its drive free to move across, both halves also sway the same way
    (antisymmetric modes).

    Parameters
    ----------
    model : ElasticMechanism
        The mechanism.
    wanted : ModesWanted
        Number of modes of each family, or highest frequency.
    """
    families = [("drive free", model, False, 1.0), ("drive held", model, True, 1.0)]
    mirrored = model.mechanism.mirrored
    if mirrored:
        families.append(("swaying drive free across", model.swaying, True, -1.0))
    found = []
    for family, moving, held, mirror in families:
        lines, points = moving.mode_lines()
        # Leave out lines on the symmetry axis, which is not an edge of the whole body.
        real = np.abs(lines[..., 0]).max(axis=1) > (_ON_AXIS * float(np.abs(lines).max()) if mirrored else -1.0)
        lines, points = lines[real], points[real]
        rad_s, shapes = _wanted_modes(
            lambda count, moving=moving, held=held: moving.modes(drive_held=held, count=count),  # type: ignore[misc]
            wanted,
            2 * MOST_MODES,
        )
        for number, (angular, shape) in enumerate(zip(rad_s, shapes.T, strict=True), 1):
            symmetric = mirrored and mirror > 0.0
            shift = _scaled(lines, shape[points], mirrored=symmetric)
            both, swing = (lines, shift), 1.0
            if mirrored:
                # The left half mirrors the right half; for swaying modes, its motion has the opposite sign.
                flip = np.array([-1.0, 1.0])
                both = np.concatenate([lines, flip * lines]), np.concatenate([shift, mirror * flip * shift])
            if symmetric:
                swing = min(1.0, _way_to_meeting(lines[..., 0], -shift[..., 0]))
            found.append(ModeShape(family, number, float(angular / (2.0 * pi)), *both, swing))
    return found


def _wanted_modes(solve: Solve, wanted: ModesWanted, unknowns: int) -> tuple[Array, Array]:
    if wanted.count is not None:
        return solve(min(wanted.count, unknowns - 2))
    count = _FIRST
    while True:
        rad_s, shapes = solve(count)
        below = rad_s <= 2.0 * pi * wanted.highest_hz
        if not below.all():
            return rad_s[below], shapes[:, below]
        if count == min(MOST_MODES, unknowns - 2):
            raise UsageError(
                f"--modes must end within {count} modes of each family, below {rad_s[-1] / (2.0 * pi):.4g} Hz, but "
                f"goes to {wanted.highest_hz:g} Hz; take a lower frequency."
            )
        count = min(2 * count, MOST_MODES, unknowns - 2)


def _scaled(lines: Array, shape: Array, *, mirrored: bool) -> Array:
    """Scale a mode shape for plotting; symmetric modes start by opening, and their halves must not intersect."""
    scale = _SHOWN * float(np.ptp(lines[..., 1])) / float(np.hypot(shape[..., 0], shape[..., 1]).max())
    if not mirrored:
        return scale * shape
    ways = [_way_to_meeting(lines[..., 0], sign * shape[..., 0]) for sign in (1.0, -1.0)]
    turned = 1.0 if ways[0] >= ways[1] else -1.0
    return turned * min(scale, max(ways)) * shape


def _way_to_meeting(x: Array, across: Array) -> float:
    """Largest scale factor of a mode shape at which no point of the half crosses the symmetry axis."""
    closing = (across < 0.0) & (x > _ON_AXIS * float(x.max()))
    return float(np.min(-x[closing] / across[closing], initial=np.inf))
