"""What may stand beside an edge: side wall, bright line or band, shadow. Each adds steps of light to the finger's own.

Light across a finger's edge is a sum of steps, all blurred by the same optics:
``finger + contrast * sum_i w_i E(x - e_i)``, with e_i the distance outwards from the finger's edge, and weights w_i
that add up to one between the finger's plateau and that of the ground. A component is such a set of steps with a prior
of its parameters, which all flanks have in common: what a wall, a shadow or a bright line does on one flank it does, by
the same law, on the others, and that is how they are told apart.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# Share of a shadow's depth on a flank, as a logit, if light comes from the front.
ALL_SIDES = 3.0
# Places of the equal steps into which light that changes evenly is divided, in units of its extent; places and shares
# of the steps of light that comes back exponentially. Steps farther apart than twice the blur would be seen.
EVEN: Floats = np.asarray((np.arange(10) + 0.5) / 10)
EXPONENTIAL: Floats = np.asarray(0.3 * (np.arange(16) + 0.5))

# Flanks on which something lies: a part of the fingers' inner sides, or what light from one side shows or hides.
Faces = Callable[[Floats, Bools], Floats]


def _inner(side: Floats, is_outer: Bools) -> Floats:
    return np.where(is_outer, 0.0, 1.0)


def _rightward(side: Floats, is_outer: Bools) -> Floats:
    return np.where(side > 0.0, 1.0, 0.0)


def _leftward(side: Floats, is_outer: Bools) -> Floats:
    return np.where(side < 0.0, 1.0, 0.0)


# Distances outwards and weights of all steps, shapes (sets, edges, steps), from parameters (sets, k), the direction of
# each edge (+1: the ground has the larger coordinates), and whether it is an outer one.
Steps = Callable[[Floats, Floats, Bools], tuple[Floats, Floats]]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Something beside the edges, with a Gaussian prior of its parameters.

    Parameters
    ----------
    name : str
        Name, as in `GapMeasurement.beside`; empty for what displaces no edge.
    steps : callable
        See `Steps`.
    mean, u : tuple of float
        Prior means and standard deviations of the parameters.
    starts : tuple of tuple of float
        Parameters from which a fit begins.
    probability : float
        Prior probability.
    u_form : float
        Relative standard uncertainty of a displacement, because real walls, shadows and lines are not even along a
        finger, and lines of other shapes fit as well.
    is_on_tip : bool
        Whether it is seen all around a finger, also beside its tip.
    """

    name: str
    steps: Steps
    mean: tuple[float, ...]
    u: tuple[float, ...]
    starts: tuple[tuple[float, ...], ...]
    probability: float
    u_form: float = 0.0
    is_on_tip: bool = False

    @property
    def is_all_round(self) -> bool:
        """Whether it adds the same light along the whole outline; a side wall or a hard shadow lies on some flanks."""
        return not self.has_wall and (self.is_on_tip or not self.name)

    @property
    def has_wall(self) -> bool:
        """Whether there is a side wall, which is no part of the finger's face and is not seen at its tip."""
        return "wall" in self.name


def _nothing(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    shape = (len(p), side.size, 1)
    return np.zeros(shape), np.ones(shape)


def _wall(faces: Faces) -> Steps:
    """Wall on the flanks for which `faces` is not zero, wide by its own parameter on flanks of either direction."""

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        seen = faces(side, is_outer)
        first = np.where(is_outer, 1, 0) if np.any(seen * is_outer) else np.where(side > 0.0, 0, 1)
        width = np.exp(p[:, first]) * seen
        tone = np.broadcast_to(_logistic(p[:, 2:3]), width.shape)
        return np.stack([np.zeros_like(width), width], -1), np.stack([tone, 1.0 - tone], -1)

    return steps


def _line(faces: Faces | None = None) -> Steps:
    """Bright line on the finger: how far inside the edge it ends, its breadth, and its light over the contrast.

    It lies along the flanks for which `faces` is not zero, or along all, where it may be unlike on outer ones.
    """

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        near = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
        far = near + np.exp(p[:, 1:2])
        light = np.exp(p[:, 2:3] + (p[:, 3:4] * is_outer if faces is None else 0.0 * side))
        light = light if faces is None else light * faces(side, is_outer)
        edge = np.zeros_like(near)
        return np.stack([edge, -far, -near], -1), np.stack([edge + 1.0, light, -light], -1)

    return steps


def _sheen(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    """Light on the finger that fades away from its edge: how far, and its part of the contrast at the edge."""
    length = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
    light = _logistic(p[:, 1:2] + p[:, 2:3] * is_outer)
    shares = np.exp(-EXPONENTIAL)
    at = np.concatenate([np.zeros((*length.shape, 1)), -length[..., None] * EXPONENTIAL], -1)
    return at, np.concatenate([1.0 - light[..., None], light[..., None] * (shares / shares.sum())], -1)


def _band(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    """Bright band on the finger up to its edge (a chamfer): its breadth, and its light over the contrast as a logit."""
    breadth = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
    light = _logistic(p[:, 1:2] + p[:, 2:3] * is_outer)
    return np.stack([-breadth, np.zeros_like(breadth)], -1), np.stack([light, 1.0 - light], -1)


def _hard_shadow(faces: Faces) -> Steps:
    """Shadow with a hard edge beside the flanks for which `faces` is not zero: its breadth, its depth as a logit."""

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        breadth = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
        depth = _logistic(p[:, 1:2]) * faces(side, is_outer)
        return np.stack([np.zeros_like(breadth), breadth], -1), np.stack([1.0 - depth, depth], -1)

    return steps


def _mark(faces: Faces) -> Steps:
    """Another tone on the finger along the flanks for which `faces` is not zero: its breadth, the change of its light.

    A pad or tape lies on the inner sides; shading changes with the direction in which a flank faces.
    """

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        breadth = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
        light = p[:, 1:2] * faces(side, is_outer)
        return np.stack([-breadth, np.zeros_like(breadth)], -1), np.stack([light, 1.0 - light], -1)

    return steps


def _motion(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    """Way of each finger while the shutter was open: it spreads the light of both flanks evenly, and moves neither."""
    way = np.exp(np.where((side > 0.0) == ~is_outer, p[:, :1], p[:, 1:2]))
    return way[..., None] * (EVEN - 0.5), np.full((*way.shape, EVEN.size), 1.0 / EVEN.size)


def _trail(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    """Earlier pictures that a camera mixes in: mean length behind each finger, positive towards larger coordinates."""
    length = side * np.where((side > 0.0) == ~is_outer, p[:, :1], p[:, 1:2])
    shares = np.exp(-EXPONENTIAL)
    return length[..., None] * EXPONENTIAL, np.broadcast_to(shares / shares.sum(), (*length.shape, shares.size))


def _spread(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    """Light spread evenly to both sides all around, by the optics or by what a camera does to its pictures."""
    width = np.broadcast_to(np.exp(p[:, :1]), (len(p), side.size))
    return width[..., None] * (EVEN - 0.5), np.full((*width.shape, EVEN.size), 1.0 / EVEN.size)


def _shadow(
    places: Floats, shares: Floats | None = None, faces: Faces | None = None, *, is_apart: bool = False
) -> Steps:
    """Shadow on the ground: its light comes back at these places, equally if not by shares; sides may be unlike.

    It begins at the edge or, of a part high above the ground, some way apart from it. Where fingers hide much of the
    light from one another, it lies beside the flanks for which `faces` is not zero.
    """
    parts = np.ones(places.size) if shares is None else shares
    parts = parts / parts.sum()

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        length = np.broadcast_to(np.exp(p[:, 1:2]), (len(p), side.size))
        # Light from the front casts the same shadow on all sides, light from one side none on its own.
        share = (
            _logistic(ALL_SIDES + side * p[:, 2:3]) / _logistic(np.array(ALL_SIDES))
            if faces is None
            else faces(side, is_outer)
        )
        depth = _logistic(p[:, :1]) * share
        rest_at = length[..., None] * places + (np.exp(p[:, 3:4, None]) if is_apart else 0.0)
        at = np.concatenate([np.zeros((*length.shape, 1)), rest_at], -1)
        return at, np.concatenate([1.0 - depth[..., None], depth[..., None] * parts], -1)

    return steps


def _logistic(x: Floats) -> Floats:
    return np.asarray(1.0 / (1.0 + np.exp(-x)))


def _log(*widths: float) -> tuple[float, ...]:
    return tuple(float(np.log(width)) for width in widths)


# Prior means and standard deviations, and starts of the fits. Widths are those of parts of 0.1 to 2 mm at 10 to
# 60 px/mm.
_WALL = ((*_log(3.0, 3.0), 0.0), (0.8, 0.8, 0.9))
_INNER_WALL = (*_WALL, tuple((*_log(width, width), 0.0) for width in (1.2, 3.0, 7.0)))
_SIDE_WALL = (*_WALL, tuple((*_log(width, width), 0.0) for width in (1.5, 4.0, 8.0)))
_LINE = (
    (*_log(2.0, 2.0, 0.5), 0.0),
    (0.7, 0.7, 0.8, 0.5),
    tuple((*_log(near, 1.5, 0.6), 0.0) for near in (0.7, 3.0)),
)
_PART_LINE = (_LINE[0][:3], _LINE[1][:3], tuple(start[:3] for start in _LINE[2]))
_BAND = ((*_log(3.0), 0.0, 0.0), (0.7, 1.2, 0.3), tuple((*_log(width), 0.0, 0.0) for width in (1.5, 4.0)))
_DEPTH_LENGTH_SIDE = (-1.0, *_log(6.0), 0.0), (1.0, 0.7, 3.0)
_SHADOW_STARTS = tuple((-1.5, *_log(length), side) for side in (0.0, 5.0, -5.0) for length in (4.0, 10.0))
_PART_SHADOW = (_DEPTH_LENGTH_SIDE[0][:2], _DEPTH_LENGTH_SIDE[1][:2], tuple(s[:2] for s in _SHADOW_STARTS[:2]))
_SHADOW = (*_DEPTH_LENGTH_SIDE, _SHADOW_STARTS)
_SHADOW_APART = (
    (*_DEPTH_LENGTH_SIDE[0], *_log(2.0)),
    (*_DEPTH_LENGTH_SIDE[1], 0.7),
    tuple((*start, *_log(2.0)) for start in _SHADOW_STARTS[::2]),
)

_HARD_SHADOW = ((*_log(6.0), 0.0), (0.7, 1.2), tuple((*_log(width), 0.0) for width in (3.0, 8.0)))
_MARK = ((*_log(5.0), 0.0), (0.7, 0.06), tuple((*_log(width), 0.05) for width in (3.0, 8.0)))
_SPREAD = (_log(2.0), (0.7,), (_log(2.0), _log(5.0)))
_TRAIL = ((0.0, 0.0), (2.0, 2.0), tuple((x, y) for x in (-1.5, 1.5) for y in (-1.5, 1.5)))
_MOTION = (_log(4.0, 4.0), (1.0, 1.0), tuple(_log(way, way) for way in (3.0, 8.0)))

NOTHING = Scene("", _nothing, (), (), ((),), 0.48)
# Prior probabilities: one recording in ten shows a wall (thick parts), a shadow, or a bright line (edges that are
# chamfered or polished); a chamfer that is evenly bright up to the edge on all sides is rare. A line on some flanks
# alone, from light of one side or on faces that were ground, looks much as the far commoner wall does.
SCENES = (
    Scene("wall", _wall(_inner), *_INNER_WALL, 0.06, 0.1),
    Scene("wall", _wall(_rightward), *_SIDE_WALL, 0.02, 0.1),
    Scene("wall", _wall(_leftward), *_SIDE_WALL, 0.02, 0.1),
    Scene("glare", _line(), *_LINE, 0.05, 0.35, True),
    Scene("glare", _band, *_BAND, 0.02, 0.35, True),
    Scene("glare", _sheen, *_BAND, 0.02, 0.35, True),
    Scene("glare", _line(_inner), *_PART_LINE, 0.002, 0.35),
    Scene("glare", _line(_rightward), *_PART_LINE, 0.002, 0.35),
    Scene("glare", _line(_leftward), *_PART_LINE, 0.002, 0.35),
    Scene("shadow", _shadow(EVEN), *_SHADOW, 0.045, 0.1, True),
    Scene("shadow", _shadow(EXPONENTIAL, np.asarray(np.exp(-EXPONENTIAL))), *_SHADOW, 0.045, 0.1, True),
    Scene("shadow", _shadow(EVEN, None, _inner), *_PART_SHADOW, 0.015, 0.1),
    Scene("shadow", _shadow(EXPONENTIAL, np.asarray(np.exp(-EXPONENTIAL)), _inner), *_PART_SHADOW, 0.015, 0.1),
    Scene("shadow", _shadow(EVEN, is_apart=True), *_SHADOW_APART, 0.01, 0.1, True),
    Scene("shadow", _hard_shadow(_rightward), *_HARD_SHADOW, 0.01, 0.1),
    Scene("shadow", _hard_shadow(_leftward), *_HARD_SHADOW, 0.01, 0.1),
    Scene("", _mark(_inner), *_MARK, 0.03),
    Scene("", _mark(_rightward), *_MARK, 0.02),
    Scene("", _mark(_leftward), *_MARK, 0.02),
    Scene("", _motion, *_MOTION, 0.05),
    Scene("", _trail, *_TRAIL, 0.03),
    Scene("", _spread, *_SPREAD, 0.1, is_on_tip=True),
)


def pair(first: Scene, second: Scene) -> Scene:
    """Two things beside the edges at once: what each adds to the finger's own step adds up."""
    count = len(first.mean)

    def steps(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
        (at, weight), (other_at, other_weight) = (
            first.steps(p[:, :count], side, is_outer),
            second.steps(p[:, count:], side, is_outer),
        )
        own = np.zeros((*at.shape[:-1], 1))
        return np.concatenate([at, other_at, own], -1), np.concatenate([weight, other_weight, own - 1.0], -1)

    name = " and ".join(sorted((first.name, second.name)))
    chance = first.probability * second.probability / NOTHING.probability
    u_form = float(np.hypot(first.u_form, second.u_form))
    starts = tuple(own + other for own in first.starts for other in second.starts)
    is_on_tip = first.is_on_tip or second.is_on_tip
    return Scene(name, steps, first.mean + second.mean, first.u + second.u, starts, chance, u_form, is_on_tip)


# Pairs that are tried where one alone does not explain the edges.
_INNER, _LINE_ALONE, _BAND_ALONE = SCENES[0], SCENES[3], SCENES[4]
_RAMP = next(scene for scene in SCENES if scene.name == "shadow")
PAIRS = (
    pair(_INNER, _LINE_ALONE),
    pair(_INNER, _BAND_ALONE),
    pair(_INNER, _RAMP),
    pair(_LINE_ALONE, _RAMP),
)

# Distances of the steps that the score test tries, at the inner edges and at all of them.
_PROBED_PX = np.array([-8.0, -4.0, -2.0, -1.0, 1.0, 2.0, 4.0, 8.0])


def _probe(p: Floats, side: Floats, is_outer: Bools) -> tuple[Floats, Floats]:
    count = _PROBED_PX.size
    light = p[:, None, :count] + p[:, None, count:] * np.where(is_outer, 0.0, 1.0)[:, None]
    at = np.broadcast_to(np.append(_PROBED_PX, 0.0), (len(p), side.size, count + 1))
    return at, np.concatenate([light, 1.0 - light.sum(axis=-1, keepdims=True)], -1)


PROBE = Scene("", _probe, (0.0,) * 16, (1.0,) * 16, (), 0.0)
