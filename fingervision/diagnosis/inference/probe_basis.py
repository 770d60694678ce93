"""Probes: generic shapes, not effects of the catalogue, that detect structure which no effect explains."""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.noise.whitening import Whitener
from fingervision.domain.effect import Array, History

SPAN = 5
"""Number of samples over which a speed is computed."""


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Whitened unit shapes with descriptions.

    Parameters
    ----------
    words : tuple of str, length k
        Descriptions.
    columns : ndarray of float, shape (m, k)
        Whitened shapes.
    bare : ndarray of float, shape (n, b)
        The different shapes before whitening; column i of `columns` has shape i modulo b.
    shares : ndarray of float, shape (k / b, channels)
        Size of a shape in each channel; column i of `columns` has row i // b.
    """

    words: tuple[str, ...]
    columns: Array
    bare: Array
    shares: Array

    def before_whitening(self, index: int) -> Array:
        """One generic shape before whitening, with channels stacked; shape (m,)."""
        kind, shape = divmod(index, self.bare.shape[1])
        return np.outer(self.shares[kind], self.bare[:, shape]).ravel()


def _speed(input_mm: Array, time_s: Array) -> Array:
    """Speed (mm/s) as the slope over `SPAN` samples: differences of neighbours would contain the input's errors."""
    if input_mm.size <= SPAN:
        return np.full(input_mm.size, float(np.ptp(input_mm)) / max(float(np.ptp(time_s)), 1e-9))
    ahead = np.minimum(np.arange(input_mm.size) + SPAN // 2 + 1, input_mm.size - 1)
    behind = np.maximum(np.arange(input_mm.size) - SPAN // 2 - 1, 0)
    around = np.stack([input_mm[ahead], input_mm[np.maximum(ahead - 1, 0)]]).mean(axis=0)
    back = np.stack([input_mm[behind], input_mm[np.minimum(behind + 1, input_mm.size - 1)]]).mean(axis=0)
    return np.asarray((around - back) / (time_s[ahead] - time_s[behind]), dtype=np.float64)


def probes(history: History, whitener: Whitener, most: int) -> Probes:
    """Make generic shapes (steps, bumps, waves, slopes) over time, input, direction and run, for each measured channel.

    Parameters
    ----------
    most : int
        Largest number of columns; beyond it, finer shapes are thinned out.
    """
    n, u = history.input_mm.size, history.input_mm
    shapes: list[tuple[str, Array]] = []
    low, span = float(u.min()), history.input_span_mm
    fine = max(6, min(40, n // 8))
    places = 2 - int(np.floor(np.log10(span)))
    for k in range(1, fine):
        at = low + span * k / fine
        there = f"input {round(at, places):.3g} mm"
        shapes.append((f"a step at {there}", (u > at).astype(float)))
        shapes.append((f"a kink at {there}", np.maximum(u - at, 0.0)))
        shapes += [
            (f"a bump about {2 * width:.2g} mm wide near {there}", np.exp(-0.5 * ((u - at) / width) ** 2))
            for width in (span / fine, span / 12.0)
        ]
    for cycles in np.arange(1.0, min(60.0, n / 6.0), 0.5):
        phase = 2.0 * np.pi * cycles * (u - low) / span
        label = f"a wave over the input with a period of {span / cycles:.3g} mm"
        shapes += [(label, np.sin(phase)), (label, np.cos(phase))]
    if history.time_s is not None:
        t = history.clock_s if history.shared_clock else np.concatenate([np.arange(n)[run] for run in history.runs]) / n
        begin, length = float(t.min()), max(float(np.ptp(t)), 1e-9)
        # Without a shared clock, time is the sample number as a share of the table.
        length_s = length if history.shared_clock else length * n * history.sample_time_s
        for k in range(1, fine):
            at = begin + length * k / fine
            label = f"{at:.3g} s" if history.shared_clock else f"{100 * k / fine:.0f} % of the table"
            shapes.append((f"a step at {label}", (t > at).astype(float)))
            shapes.append((f"a bump at {label}", np.exp(-0.5 * ((t - at) / (length / fine)) ** 2)))
        for cycles in np.arange(1.0, min(120.0, n / 6.0), 0.5):
            phase = 2.0 * np.pi * cycles * (t - begin) / length
            label = f"a wave over time with a period of {length_s / cycles:.3g} s"
            shapes += [(label, np.sin(phase)), (label, np.cos(phase))]
        speed = np.concatenate([_speed(u[run], history.times[run]) for run in history.runs])
        sense = np.sign(np.where(np.abs(speed) > 0.1 * np.max(np.abs(speed)), speed, 0.0))
        shapes += [
            ("a difference between opening and closing", sense),
            ("a different slope for opening and closing", sense * (u - low)),
            ("a part proportional to the speed", speed),
        ]
        for index, run in enumerate(history.runs):
            mask = np.zeros(n)
            mask[run] = np.linspace(-1.0, 1.0, run.stop - run.start)
            shapes.append((f"a drift within run {index + 1}", mask))
    for index, run in enumerate(history.runs):
        if len(history.runs) > 1:
            mask = np.zeros(n)
            mask[run] = u[run] - np.mean(u[run])
            shapes.append((f"a different slope in run {index + 1}", mask))
    shapes += [(f"curvature of order {k} over the input", ((u - low) / span) ** k) for k in (2, 3, 4)]
    channels = [(1.0, 0.0, 0.0, "the gap")]
    if history.both_edges:
        channels += [
            (0.0, 1.0, 0.0, "the midline"),
            (-1.0, 0.5, 0.0, "the left edge"),
            (1.0, 0.5, 0.0, "the right edge"),
        ]
    if history.force:
        channels.append((0.0, 0.0, 1.0, "the force"))
    shapes = shapes[:: max(1, len(shapes) * len(channels) // most)]
    words = tuple(f"{label} in {channel}" for *_, channel in channels for label, _ in shapes)
    bare = np.array([shape for _, shape in shapes]).T
    # Each shape is whitened once per channel; shapes of the edges are sums of those of gap and midline.
    shares = np.array(
        [
            [gap, midline, force][: 1 + history.both_edges] + [force] * history.force
            for gap, midline, force, _ in channels
        ]
    )
    count = bare.shape[1]
    columns = np.empty((shares.shape[1] * n, len(words)))
    for channel in range(shares.shape[1]):
        whitened = whitener.of_channel(bare, channel)
        rows = columns[channel * n : (channel + 1) * n]
        for k, share in enumerate(shares[:, channel]):
            np.multiply(whitened, share, out=rows[:, k * count : (k + 1) * count])
    return Probes(words, columns, bare, shares)
