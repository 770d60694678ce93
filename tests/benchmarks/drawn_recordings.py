"""Drawn recordings beside a stage's log, with their truth: motions, encoders, noise and clocks of a laboratory.

Nothing here is shared with the product: the path is a function of true time on a fine grid, the mechanism follows it
sample by sample, and both records are read off at their own instants.
"""

from dataclasses import dataclass, replace

import numpy as np

FINE_HZ = 4000.0
MOTIONS = ("random steps", "growing triangles", "sine sweep", "ISO staircase", "strokes", "wander")
ENCODERS = ("exact", "noisy", "encoder")


@dataclass(frozen=True)
class Kind:
    """What is drawn; lengths in mm, times in s, rates in Hz."""

    motion: str
    duration_s: float
    range_mm: float
    speed: float
    smooth_s: float
    play_mm: float
    creep: float
    bend: float
    noise_mm: float
    correlation: float
    log_hz: float
    log_jitter: float
    encoder_mm: float
    log_noise_mm: float
    missing: float
    set_points: bool
    frame_hz: float
    offset_s: float
    rate: float


@dataclass(frozen=True)
class Drawn:
    """A recording and a log on their own clocks."""

    kind: Kind
    time_s: np.ndarray
    gap_mm: np.ndarray
    log_s: np.ndarray
    input_mm: np.ndarray

    def log_time_s(self, time_s):
        """True time on the log's clock at an instant of the recording's."""
        return (time_s - self.kind.offset_s) / (1.0 + self.kind.rate)


def kind(rng, camera_hz=25.0):
    """Draw a kind of recording."""

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    log_is = rng.choice(ENCODERS, p=[0.15, 0.35, 0.5])
    return Kind(
        motion=str(rng.choice(MOTIONS)),
        duration_s=rng.uniform(12.0, 60.0),
        range_mm=rng.uniform(0.3, 2.0),
        speed=between(0.1, 2.0),
        smooth_s=0.0 if rng.random() < 0.4 else between(0.02, 0.3),
        play_mm=0.0 if rng.random() < 0.15 else rng.uniform(0.0, 0.1),
        creep=0.0 if rng.random() < 0.7 else rng.uniform(0.005, 0.03),
        bend=rng.uniform(-0.03, 0.03),
        noise_mm=between(2e-4, 5e-3),
        correlation=float(rng.choice([0.0, 0.3, 0.7])),
        log_hz=between(5.0, 120.0),
        log_jitter=0.0 if rng.random() < 0.6 else rng.uniform(0.0, 0.2),
        encoder_mm=between(1e-4, 3e-2) if log_is == "encoder" else 0.0,
        log_noise_mm=between(3e-5, 1e-3) if log_is == "noisy" else 0.0,
        missing=0.0 if rng.random() < 0.7 else rng.uniform(0.0, 0.1),
        set_points=bool(rng.random() < 0.08),
        frame_hz=camera_hz,
        offset_s=rng.uniform(-60.0, 60.0),
        rate=0.0 if rng.random() < 0.3 else rng.uniform(-1e-3, 1e-3),
    )


def corners(rng, of):
    """Targets of a motion: corner times and places."""
    top, speed = of.range_mm, of.speed * of.range_mm
    first = rng.uniform(0.3, 2.0)
    times, places = [0.0, first], [0.0, 0.0]

    def go(target, dwell):
        times.append(times[-1] + max(abs(target - places[-1]) / speed, 0.05))
        places.append(target)
        if dwell > 0.0:
            times.append(times[-1] + dwell)
            places.append(target)

    if of.motion == "wander":
        step = rng.uniform(0.8, 3.0)
        while times[-1] < of.duration_s:
            times.append(times[-1] + step)
            places.append(rng.uniform(0.0, top))
    elif of.motion == "growing triangles":
        grows, share, up = rng.uniform(0.03, 0.2), rng.uniform(0.1, 0.5), True
        while times[-1] < of.duration_s:
            go(share * top if up else 0.0, 0.0)
            if not up:
                share = share + grows if share + grows <= 1.0 else 0.15
            up = not up
    elif of.motion == "ISO staircase":
        targets = np.linspace(0.1, 0.9, rng.integers(5, 10)) * top
        dwell = rng.uniform(0.5, 1.5)
        while times[-1] < of.duration_s:
            go(0.0, 0.2)
            for target in targets:
                go(target, dwell)
            go(top, 0.2)
            for target in targets[::-1]:
                go(target, dwell)
    elif of.motion == "random steps":
        while times[-1] < of.duration_s:
            go(rng.uniform(0.0, top), rng.uniform(0.3, 2.0))
    else:
        while times[-1] < of.duration_s:
            go(rng.uniform(0.0, top), 0.0 if rng.random() < 0.5 else rng.uniform(0.2, 1.0))
    return np.array(times), np.array(places)


def path(rng, of):
    """Place of the stage at every fine instant, and its target."""
    t = np.arange(int(of.duration_s * FINE_HZ)) / FINE_HZ
    if of.motion == "sine sweep":
        begin, low, high = rng.uniform(0.3, 2.0), rng.uniform(0.1, 0.3), rng.uniform(0.5, 1.5)
        since = np.clip(t - begin, 0.0, None)
        phase = 2.0 * np.pi * (low * since + 0.5 * (high - low) / of.duration_s * since**2)
        place = 0.5 * of.range_mm * (1.0 - np.cos(phase))
        return t, place, place
    times, places = corners(rng, of)
    target = places[np.clip(np.searchsorted(times, t, side="right"), 0, places.size - 1)]
    place = np.interp(t, times, places)
    if of.smooth_s > 0.0:
        n = max(int(of.smooth_s * FINE_HZ), 1)
        padded = np.concatenate([np.full(n, place[0]), place])
        sums = np.cumsum(padded)
        place = (sums[n:] - sums[:-n]) / n
    return t, place, target


def behind(place, width, state):
    """Play of full width, sample by sample; its state begins so many half widths above the first place."""
    if width == 0.0:
        return place
    half = 0.5 * width
    at = place[0] + state * half
    out = place.tolist()
    for i, v in enumerate(out):
        if at < v - half:
            at = v - half
        elif at > v + half:
            at = v + half
        out[i] = at
    return np.array(out)


def draw(seed, camera_hz=25.0, **fixed):
    """Draw a recording; `fixed` sets fields of the kind and leaves every other draw as it is."""
    of_kind, of_path, of_log, of_frames = (np.random.default_rng(one) for one in np.random.SeedSequence(seed).spawn(4))
    of = replace(kind(of_kind, camera_hz), **fixed)
    t, place, target = path(of_path, of)
    moved = behind(place, of.play_mm, of_path.uniform(-1.0, 1.0))
    if of.creep:
        share, slow, lag = 1.0 / (FINE_HZ * 3.0), moved[0], moved.tolist()
        for i, v in enumerate(lag):
            slow += share * (v - slow)
            lag[i] = slow
        moved = moved + of.creep * (np.array(lag) - moved)
    edge = 0.15 * of.duration_s
    ends = [max(0.0, of_path.uniform(-edge, edge)) for _ in range(4)]
    log_true = np.arange(ends[0], of.duration_s - ends[1], 1.0 / of.log_hz)
    log_true = np.sort(log_true + of.log_jitter / of.log_hz * of_log.uniform(-0.5, 0.5, log_true.size))
    log_true = log_true[of_log.random(log_true.size) >= of.missing]
    rows = np.interp(log_true, t, place)
    if of.set_points:
        rows = target[np.clip((log_true * FINE_HZ).astype(int), 0, t.size - 1)]
    rows = rows + of_log.normal(0.0, 1.0, rows.size) * of.log_noise_mm
    phase = of_log.uniform(0.0, 1.0)
    if of.encoder_mm and not of.set_points:
        rows = (np.round(rows / of.encoder_mm + phase) - phase) * of.encoder_mm
    film = np.arange(ends[2], of.duration_s - ends[3], 1.0 / of.frame_hz)
    film = film[of_frames.random(film.size) >= 0.5 * of.missing]
    u = np.interp(film, t, moved)
    gap = 1.2 + 7.72 * (u + of.bend * u * (u / of.range_mm - 1.0))
    noise = of_frames.normal(0.0, of.noise_mm, gap.size)
    for i in range(1, gap.size):
        noise[i] = of.correlation * noise[i - 1] + np.sqrt(1.0 - of.correlation**2) * noise[i]
    start = log_true[0]
    return Drawn(of, (film - start) * (1.0 + of.rate) + of.offset_s, gap + noise, log_true - start, rows)
