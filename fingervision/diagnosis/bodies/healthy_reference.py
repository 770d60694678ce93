"""What differs between a recording of a specimen and an earlier, healthy recording of the same specimen.

The error of the model (0.7 % of a slope) hides a hinge that is a few per cent too thin; a healthy recording does not
have this error. In the healthy recording the channels are y_h = B(u) a + e, with B a free polynomial of the input; in
the faulty one y_f = B(u) a + J p + N n + e, with J the model's sensitivity to a change of one part and N nuisances with
priors. No rows or strokes are paired. The thicknesses and places of the flexures at rest, faulty minus healthy, are
further rows of the same least-squares problem, and need no mechanics.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.channel_noise import ChannelNoise, channel_noise
from fingervision.diagnosis.bodies.place_nuisances import RandomEffects
from fingervision.diagnosis.bodies.place_search import ALIKE, PLAYS_MM, STRUCTURE_SHARE
from fingervision.domain.body_poses import FlexureOutline
from fingervision.models.place_answers import PARTS, PlaceAnswers, PlaceChanges

Array = NDArray[np.float64]

DEGREE = 5
"""Degree of the free polynomial of the input: large rotations of a flexure mechanism leave less than a micrometre."""
FALSE_CLAIM = 1e-3
"""Probability of a claim about a pair of recordings between which nothing changed (Bonferroni over the candidates)."""
MOST_PLACES = 4
"""Largest number of places that an answer names; more places do not tell anybody where to look."""
OF_SENSITIVITY, OF_UNIT = 0.03, 0.3
"""Relative standard error of a sensitivity of the model, in every channel, and least size of a channel for this
purpose, relative to the largest channel with the same unit. Without it, sets of places come out falsely unique."""
GAIN, SCALE, TURN = 3e-3, 5e-4, 2e-3
"""Prior standard deviations between the two days: gain of the input (a gauge that was set up anew), scale of the
picture (two calibrations), rotation of the drawing in the picture (rad). A gain that was off by 0.3 % was named as a
fault when its prior was 0.02 %."""
OFFSET_MM, REFERENCE_MM, LAID_MM, EDGE_MM = 0.02, 0.05, 0.02, 0.01
"""The same for the zero of the input, the reference point of each body, the position of the drawing in the picture, and
what light and focus add to every thickness."""
SMOOTH = 0.5
"""Prior standard deviation of a smooth error of a channel over the input, in standard deviations of one reading: errors
of edges that return at the same place are smaller than the scatter of one reading."""
SMALL = 0.03
"""Relative change of a thickness at which its sensitivity is computed."""
TOLERANCE = 0.006
"""Prior standard deviation of every thickness, relative: specimens that are made within 1 % of each other. Without it,
another specimen than the healthy one had its two most different flexures named as faulty."""
MOST_SHARE, MOST_MM = 0.5, 1.0
"""Largest relative change of a thickness or stiffness, and largest displacement."""
STEPS = 3
"""Number of times that a sensitivity is computed again at the size that was found."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The channels of one recording, with their noise.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    values : ndarray of float, shape (n, channels)
        Measured values.
    way : ndarray of float, shape (n,)
        Direction of the motion: 1 for opening, -1 for closing, 0 for a table without times.
    noise : ChannelNoise
        Joint noise of all channels.
    """

    input_mm: Array
    values: Array
    way: Array
    noise: ChannelNoise

    @classmethod
    def of(cls, input_mm: Array, values: Array, runs: tuple[slice, ...], floors: Array, *, timed: bool) -> "Recording":
        """Estimate the noise of the channels of a recording.

        Parameters
        ----------
        input_mm : ndarray of float, shape (n,)
            Recorded input.
        values : ndarray of float, shape (n, channels)
            Measured values.
        runs : tuple of slice
            Rows of each run.
        floors : ndarray of float, shape (channels,)
            Least noise of each channel.
        timed : bool
            Whether the rows are in order of time.
        """
        way = np.zeros(input_mm.size)
        for run in runs if timed else ():
            if run.stop - run.start > 1:
                way[run] = np.sign(np.gradient(input_mm[run]))
        return cls(input_mm, values, way, channel_noise(values, input_mm, runs, floors, timed=timed))


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One thing that may have changed, with one size.

    Parameters
    ----------
    place : str
        Name of the flexure.
    kind : str
        `thickness`, `stiffness` (without a change of the outline: material or a crack), `along`, `across` or `play`.
    reference : float
        Size at which the sensitivity is computed first; mm, or a relative change of stiffness.
    moves : callable
        Maps a size to the change of every channel, shape (n, channels).
    most : float
        Largest size; a larger one would be seen by eye, or the part would be broken.
    outline : (int, int) or None
        Number of the flexure, and 0 for its thickness, 1 for its place along and 2 across its axis; None if the change
        is not visible in an outline.
    """

    place: str
    kind: str
    reference: float
    most: float
    moves: Callable[[float], Array]
    outline: tuple[int, int] | None


@dataclass(frozen=True, slots=True, eq=False)
class FittedChange:
    """A change with its fitted size.

    Parameters
    ----------
    change : Change
        The change.
    size, u : float
        Size and its standard uncertainty.
    gain : float
        Reduction of chi-square.
    """

    change: Change
    size: float
    u: float
    gain: float


@dataclass(frozen=True, slots=True, eq=False)
class WhatChanged:
    """Result of a comparison with a healthy recording.

    Parameters
    ----------
    changed : bool
        Whether anything changed.
    members : tuple of FittedChange
        The most likely change, and all those that the recordings do not distinguish from it, best first; empty if
        nothing changed, or if no single change explains what did.
    by_place : mapping of str to float
        Largest reduction of chi-square of each flexure, divided by the limit of a claim.
    smallest : mapping of str to FittedChange
        For each flexure, the smallest change of thickness that would have been claimed, as its size.
    places : tuple of str
        The flexures of `members`.
    more_frames : float
        Factor by which more frames of the same motion would separate the members; infinite if none would.
    """

    changed: bool
    members: tuple[FittedChange, ...]
    by_place: Mapping[str, float]
    smallest: Mapping[str, FittedChange]
    more_frames: float

    @property
    def places(self) -> tuple[str, ...]:
        """The flexures of the members, best first."""
        return tuple(dict.fromkeys(member.change.place for member in self.members))

    @property
    def told(self) -> bool:
        """Whether the place of the change is known to be one of a few."""
        return 0 < len(self.places) <= MOST_PLACES


@dataclass(frozen=True, eq=False)
class HealthyReference:
    """Comparison of two recordings of one specimen.

    Parameters
    ----------
    answers : PlaceAnswers
        The drawing.
    channels : tuple of str
        Names of the channels in the drawing; empty without a motion.
    healthy, faulty : Recording or None
        The two recordings; None without a motion.
    outlines : tuple of two mappings
        Flexures at rest in the healthy and in the faulty recording, by name.
    """

    answers: PlaceAnswers
    channels: tuple[str, ...]
    healthy: Recording | None
    faulty: Recording | None
    outlines: tuple[Mapping[str, FlexureOutline], Mapping[str, FlexureOutline]]

    @cached_property
    def prediction(self) -> BodyPrediction:
        """Predictions of the drawing at the inputs of the faulty recording."""
        return BodyPrediction(self.answers, self.channels, np.zeros(0) if self.faulty is None else self.faulty.input_mm)

    @cached_property
    def _outline(self) -> tuple[Array, Array]:
        """Differences of the flexures at rest, faulty minus healthy, and their u; shape (flexures, 3), nan: unseen."""
        flexures = self.answers.mechanism.flexures
        by, u = np.full((len(flexures), 3), np.nan), np.full((len(flexures), 3), np.nan)
        for number, flexure in enumerate(flexures):
            pair = [seen.get(flexure.name) for seen in self.outlines]
            if pair[0] is None or pair[1] is None:
                continue
            for part, name in enumerate(("thickness_mm", "along_mm", "across_mm")):
                before, after = (getattr(one, name) for one in pair)
                if before is not None and after is not None:
                    by[number, part], u[number, part] = after[0] - before[0], np.hypot(after[1], before[1])
        return by, u

    def _rows(self, motion: Array | None = None, still: Array | None = None, healthy: Array | None = None) -> Array:
        """Whiten a signal in the healthy motion, the faulty motion and the outlines, and join the three."""
        parts = []
        for recording, signal in ((self.healthy, healthy), (self.faulty, motion)):
            if recording is not None:
                rows = np.zeros_like(recording.values) if signal is None else signal
                parts.append(recording.noise.whitened(rows))
        by, u = self._outline
        seen = np.isfinite(by)
        parts.append((np.zeros_like(by) if still is None else still)[seen] / u[seen])
        return np.concatenate(parts)

    @cached_property
    def _measured(self) -> Array:
        healthy, faulty = (None if one is None else one.values for one in (self.healthy, self.faulty))
        return self._rows(faulty, self._outline[0], healthy)

    def _nuisances(self) -> list[tuple[Array, float]]:
        """Whitened columns of what may differ between two sound recordings, with prior standard deviations."""
        found = [*self._of_motion(), *self._of_outlines()]
        thickness = [one for one in self._candidates if one.kind == "thickness"]
        units = [(self._signature(one, one.reference) / one.reference, one) for one in thickness]
        return [*found, *((unit, TOLERANCE / SMALL * one.reference) for unit, one in units if np.any(unit))]

    def _of_motion(self) -> list[tuple[Array, float]]:
        if self.healthy is None or self.faulty is None:
            return []
        prediction, count = self.prediction, len(self.channels)
        inputs = [self.healthy.input_mm, self.faulty.input_mm]
        low, high = (float(end(np.concatenate(inputs))) for end in (np.min, np.max))
        curves = [np.polynomial.legendre.legvander((2.0 * u - low - high) / (high - low), DEGREE) for u in inputs]
        # A reversal that both recordings have (a play of the stage) is no change.
        ways = [recording.way for recording in (self.healthy, self.faulty)]
        if all(np.ptp(way) > 0.0 for way in ways):
            curves = [np.column_stack([curve, way]) for curve, way in zip(curves, ways, strict=True)]
        found: list[tuple[Array, float]] = []

        def add(rows: Array, sd: float) -> None:
            found.append((self._rows(rows), sd))

        share = inputs[1] / max(float(np.abs(inputs[1]).max()), 1e-12)
        for channel, name in enumerate(self.channels):
            for power in range(curves[0].shape[1]):
                both = [np.zeros((u.size, count)) for u in inputs]
                for own, curve in zip(both, curves, strict=True):
                    own[:, channel] = curve[:, power]
                found.append((self._rows(both[1], None, both[0]), np.inf))
            smooth = SMOOTH * max(self.healthy.noise.sd[channel], self.faulty.noise.sd[channel])
            for power in range(4):
                own = np.zeros((inputs[1].size, count))
                own[:, channel] = share**power
                add(own, np.inf if power == 0 else smooth)
            if name.endswith(".angle_mrad") and f"{name.split('.')[0]}.x_mm" in self.channels:
                body = name.split(".")[0]
                for part, sign in ((f"{body}.x_mm", -1.0), (f"{body}.y_mm", 1.0)):
                    own = np.zeros((inputs[1].size, count))
                    if part in self.channels:
                        own[:, self.channels.index(part)] = sign * 1e-3 * prediction.drawn[:, channel]
                        add(own, REFERENCE_MM)
        is_mm = np.array([name.endswith("_mm") for name in self.channels])
        slope = prediction.drawn / np.where(inputs[1] == 0.0, 1.0, inputs[1])[:, None]
        add(prediction.turned(), TURN)
        add(prediction.drawn * is_mm, SCALE)
        add(prediction.drawn, GAIN)
        add(slope, OFFSET_MM)
        add(slope * self.faulty.way[:, None], OFFSET_MM)
        return found

    def _of_outlines(self) -> list[tuple[Array, float]]:
        flexures = self.answers.mechanism.flexures
        if not np.isfinite(self._outline[0]).any():
            return []
        at = np.array([flexure.at_mm for flexure in flexures])
        ways = (np.tile(way, (len(flexures), 1)) for way in ((1.0, 0.0), (0.0, 1.0)))
        still = [(_in_axes(self.answers, way), LAID_MM) for way in ways]
        still.append((_in_axes(self.answers, np.stack([-at[:, 1], at[:, 0]], axis=1)), TURN))
        scaled = _in_axes(self.answers, at)
        scaled[:, 0] = [flexure.thickness_mm for flexure in flexures]
        still.append((scaled, SCALE))
        still.append((_in_axes(self.answers, self._moved_by_input()), OFFSET_MM))
        wider = np.zeros((len(flexures), 3))
        wider[:, 0] = 1.0
        still.append((wider, EDGE_MM))
        return [(self._rows(None, column), sd) for column, sd in still]

    def _moved_by_input(self) -> Array:
        """Displacement of every flexure per 1 mm of input, shape (flexures, 2): mean of the bodies that it joins."""
        answers, slopes = self.answers, self.answers.answer().by_input
        bodies = answers.numbered_bodies()
        out = np.zeros((len(answers.mechanism.flexures), 2))
        for number, flexure in enumerate(answers.mechanism.flexures):
            for end in answers.ends(number):
                body = bodies[end]
                if body.name in answers.moving_bodies:
                    x, y, mrad = (slopes[answers.channels.index(f"{body.name}.{part}")] for part in PARTS)
                    arm = np.subtract(flexure.at_mm, body.centroid_mm)
                    out[number] += 0.5 * np.array([x - 1e-3 * mrad * arm[1], y + 1e-3 * mrad * arm[0]])
        return out

    @cached_property
    def _candidates(self) -> list[Change]:
        found = []
        for number, flexure in enumerate(self.answers.mechanism.flexures):
            angle = np.deg2rad(flexure.axis_deg)
            axes = ((float(np.cos(angle)), float(np.sin(angle))), (float(-np.sin(angle)), float(np.cos(angle))))
            thicker = self._thicker(number)
            drawn = flexure.thickness_mm
            found.append(Change(flexure.name, "thickness", SMALL * drawn, MOST_SHARE * drawn, thicker, (number, 0)))
            if np.isfinite(self._outline[0][number, 0]) and self.channels:
                found.append(Change(flexure.name, "stiffness", SMALL, MOST_SHARE, self._stiffer(number), None))
            for part, (kind, way) in enumerate(zip(("along", "across"), axes, strict=True), 1):
                found.append(Change(flexure.name, kind, 0.1, MOST_MM, self._shifted(number, way), (number, part)))
            if self.channels:
                found.append(Change(flexure.name, "play", 0.02, MOST_MM, self._slipping(number), None))
        return found

    def _thicker(self, number: int) -> Callable[[float], Array]:
        drawn = self.answers.mechanism.flexures[number].thickness_mm
        ratio = self.answers.thickness_for(number, SMALL) / drawn
        # Between two thicknesses that differ little, bending stiffness follows a power of the thickness.
        power = float(np.log1p(SMALL) / np.log(ratio))
        stiffer = self._stiffer(number)
        return lambda size: stiffer(max(1.0 + size / drawn, 0.5) ** power - 1.0)

    def _stiffer(self, number: int) -> Callable[[float], Array]:
        return lambda size: self.prediction.changed(PlaceChanges({number: size}, {}, {}))

    def _shifted(self, number: int, way: tuple[float, float]) -> Callable[[float], Array]:
        return lambda size: self.prediction.changed(PlaceChanges({}, {number: (size * way[0], size * way[1])}, {}))

    def _slipping(self, number: int) -> Callable[[float], Array]:
        return lambda size: self.prediction.slipped(number, size)

    def _signature(self, change: Change, size: float) -> Array:
        still = np.zeros_like(self._outline[0])
        if change.outline is not None:
            still[change.outline] = size
        return self._rows(change.moves(size) if self.channels else None, still)

    def _fit(self, change: Change, beside: RandomEffects, left: Array) -> FittedChange:
        """Fit the size of a change; a play, whose signature does not grow with its size, is scanned."""
        if change.kind == "play":
            trials = [(beside.beside(self._signature(change, float(size))), float(size)) for size in PLAYS_MM[::2]]
            gain, size, norm = max((float(2.0 * s @ left - s @ s), size, float(s @ s)) for s, size in trials)
            return FittedChange(change, size, size / max(norm, 1e-300) ** 0.5, max(gain, 0.0))
        size = change.reference
        for _ in range(STEPS):
            unit = beside.beside(self._signature(change, size)) / size
            norm = float(unit @ unit)
            if norm <= 0.0:
                return FittedChange(change, 0.0, np.inf, 0.0)
            found = float(np.clip(float(unit @ left) / norm, -change.most, change.most))
            # A size without significance keeps the sensitivity of the reference.
            if abs(found - size) < 0.1 * norm**-0.5 or found**2 * norm < ALIKE:
                break
            size = found
        return FittedChange(change, found, norm**-0.5, max(0.0, 2.0 * found * float(unit @ left) - found**2 * norm))

    def _form_errors(self, best: FittedChange) -> list[tuple[Array, float]]:
        """Whitened columns of the model's error in the sensitivity to a change that was found, by channel."""
        if self.faulty is None:
            return []
        moved = np.abs(best.change.moves(best.size)).max(axis=0)
        share = self.faulty.input_mm / max(float(np.abs(self.faulty.input_mm).max()), 1e-12)
        found = []
        for channel, name in enumerate(self.channels):
            alike = max(moved[k] for k, other in enumerate(self.channels) if other[-4:] == name[-4:])
            sd = OF_SENSITIVITY * max(moved[channel], OF_UNIT * alike)
            for power in (1, 2):
                own = np.zeros_like(self.faulty.values)
                own[:, channel] = share**power
                found.append((self._rows(own), sd / power))
        return found

    def run(self) -> WhatChanged:
        """Decide whether anything changed, and where."""
        nuisances = self._nuisances()
        beside = RandomEffects(nuisances)
        left = beside.beside(self._measured)
        first = [self._fit(change, beside, left) for change in self._candidates]
        limit = float(chdtri(1, FALSE_CLAIM / len(first)))
        best = max(first, key=lambda one: one.gain)
        # What no candidate explains widens all uncertainties.
        degrees = max(self._degrees(nuisances), 1)
        excess = max(1.0, (float(left @ left) - best.gain) / degrees)
        smallest = {one.change.place: FittedChange(one.change, float(np.sqrt(limit * excess)) * one.u, one.u, 0.0)
                    for one in first if one.change.kind == "thickness"}  # fmt: skip
        by_place: dict[str, float] = {}
        for one in first:
            by_place[one.change.place] = max(by_place.get(one.change.place, 0.0), one.gain / limit / excess)
        # A shape of any kind in any channel or outline is a change, whether or not a candidate explains it.
        if best.gain < limit * excess:
            shaped = float(left @ left) > float(chdtri(degrees, FALSE_CLAIM)) * _noise_of_noise(self, degrees)
            return WhatChanged(shaped, (), by_place, smallest, np.inf)
        wider = RandomEffects([*nuisances, *self._form_errors(best)])
        left = wider.beside(self._measured)
        second = sorted((self._fit(change, wider, left) for change in self._candidates), key=lambda one: -one.gain)
        top = second[0]
        rest = float(left @ left) - top.gain
        excess = max(1.0, rest / degrees)
        if rest - degrees > max(STRUCTURE_SHARE * top.gain, float(chdtri(degrees, FALSE_CLAIM)) - degrees):
            return WhatChanged(True, (), by_place, smallest, np.inf)
        members = tuple(one for one in second if top.gain - one.gain < ALIKE * excess)
        behind = min((top.gain - one.gain for one in members if one.change.place != top.change.place), default=np.inf)
        return WhatChanged(True, members, by_place, smallest, max(1.0, ALIKE * excess / max(behind, 1e-9)))

    def _degrees(self, nuisances: Sequence[tuple[Array, float]]) -> int:
        free = sum(not np.isfinite(sd) for _, sd in nuisances)
        kept = int(np.count_nonzero(np.isfinite(self._outline[0])))
        for recording in (self.healthy, self.faulty):
            if recording is not None:
                kept += int(recording.noise.kept.sum()) * recording.noise.mixing.shape[1]
        return kept - free


def _noise_of_noise(reference: HealthyReference, degrees: int) -> float:
    """Factor on a limit of chi-square, because the noise of a motion is itself estimated from as many readings."""
    return 1.0 if reference.faulty is None else 1.0 + 3.0 * float(np.sqrt(2.0 / degrees))


def _in_axes(answers: PlaceAnswers, moved_mm: Array) -> Array:
    """Displacements of the flexures, shape (n, 2), in the axes of each: columns thickness (0), along, across."""
    angle = np.deg2rad([flexure.axis_deg for flexure in answers.mechanism.flexures])
    along = moved_mm[:, 0] * np.cos(angle) + moved_mm[:, 1] * np.sin(angle)
    across = -moved_mm[:, 0] * np.sin(angle) + moved_mm[:, 1] * np.cos(angle)
    return np.stack([np.zeros(len(angle)), along, across], axis=1)
