"""One random experiment with its truth, whose effects are scaled to a signal-to-noise ratio."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.design import Design, Kind, draw_design
from tests.benchmarks.hidden.foreign import Foreign, draw_foreign
from tests.benchmarks.hidden.gripper_table import draw_table
from tests.benchmarks.hidden.noise import Noise, draw_noise, edge_errors, rounded
from tests.benchmarks.hidden.plant import Hidden, Plant, Trace
from tests.benchmarks.hidden.sizes import CLOCKED, NAMES, draw_hidden, scaled, within_bounds

Array = NDArray[np.float64]
TRIES = 200


class NotDrawnError(ValueError):
    """No effect of the required size is within its bounds for the gripper."""


@dataclass(frozen=True, slots=True)
class Row:
    """Specification of one row of the benchmark's table.

    Parameters
    ----------
    name : str
        Name that is printed in the table.
    kinds : tuple of str
        Designs from which one is drawn.
    hidden : int
        Number of effects of the catalogue.
    foreign : bool
        Whether an effect from outside the catalogue acts.
    snr : tuple of float
        Signal-to-noise ratios from which one is drawn; 0 means an ordinary size without scaling.
    names : tuple of str
        Effects from which one is drawn; if empty, the whole catalogue of the first rows.
    beside : tuple of str
        Effects from which the second effect is drawn; if empty, the same as for the first effect.
    free_start : bool
        Whether plays and frictions have random start states (at an end in two of three runs) instead of centred ones.
    """

    name: str
    kinds: tuple[Kind, ...]
    hidden: int
    foreign: bool
    snr: tuple[float, ...]
    names: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    free_start: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """Complete description of one table: gripper and effects, runs, noise, and seed of the noise."""

    plant: Plant
    design: Design
    noise: Noise
    snr: float
    seed: int

    def starts_s(self) -> list[float]:
        """Start times of the runs since the first frame of the table."""
        starts, now = [], 0.0
        for motion in self.design.motions:
            starts.append(now)
            now += motion.duration_s + self.design.pause_s
        return starts

    def traces(self) -> list[Trace]:
        """Simulated runs without noise."""
        return [
            self.plant.trace(motion, self.design.rate_hz, start, k)
            for k, (motion, start) in enumerate(zip(self.design.motions, self.starts_s(), strict=True))
        ]


def edges(traces: list[Trace]) -> Array:
    """Left and right edge in all runs, shape (2, n), in mm."""
    return np.array([np.concatenate([t.left_mm for t in traces]), np.concatenate([t.right_mm for t in traces])])


def run_of(traces: list[Trace]) -> NDArray[np.int64]:
    """Run number of each sample, shape (n,)."""
    return np.repeat(np.arange(len(traces)), [len(t.input_mm) for t in traces])


def remaining_rms_mm(signal: Array, run: NDArray[np.int64]) -> float:
    """RMS of both edges after subtraction of the midline's constant and the offsets of the runs.

    Only the deviations of each run's mean from the mean of all runs are subtracted for each edge; otherwise an offset
    could not be found.
    """
    gap, midline = signal[1] - signal[0], signal.mean(axis=0)
    for channel, constant_is_free in ((gap, False), (midline, True)):
        means = np.array([channel[run == k].mean() for k in range(run.max() + 1)])
        channel -= (means - means.mean())[run]
        if constant_is_free:
            channel -= channel.mean()
    return float(np.sqrt(np.mean(midline**2 + gap**2 / 4)))


def _signal(plant: Plant, experiment: Experiment) -> Array:
    bare = replace(experiment, plant=replace(plant, hidden=(), foreign=None))
    with_it = replace(experiment, plant=plant)
    if any(h.name == "hinge_stiffness_error" for h in plant.hidden):
        return np.array(
            [np.concatenate([a.force_n - b.force_n for a, b in zip(with_it.traces(), bare.traces(), strict=True)])] * 2
        )
    return edges(with_it.traces()) - edges(bare.traces())


def ratio(plant: Plant, experiment: Experiment) -> float:
    """Signal-to-noise ratio of the simulated effects; for effects on the force, with the noise of the force."""
    force = any(h.name == "hinge_stiffness_error" for h in plant.hidden)
    signal = _signal(plant, experiment)
    if force:
        return float(np.sqrt(np.mean(signal**2)) / experiment.noise.force_n)
    return remaining_rms_mm(signal, run_of(experiment.traces())) / experiment.noise.edge_mm


def _sized(effect: Hidden, experiment: Experiment, snr: float) -> Hidden | None:
    plant = experiment.plant
    rate = experiment.design.rate_hz

    def at(log_factor: float) -> tuple[float, Hidden]:
        now = scaled(effect, float(np.exp(log_factor)), plant.inputs, plant.table)
        return ratio(replace(plant, hidden=(now,), foreign=None), experiment), now

    low, high = -6.0, 3.0
    best = None
    for _ in range(18):
        middle = (low + high) / 2
        reached, now = at(middle)
        if reached > snr:
            high = middle
        else:
            low = middle
        if abs(reached / snr - 1) < 0.02:
            best = now
            break
    if best is None or not within_bounds(best, plant.table, plant.inputs, rate):
        return None
    if best.name == "stick_slip":
        seen = max(2 * experiment.noise.encoder_step_mm, 6 * np.sqrt(experiment.noise.input_variance_mm2))
        if best.parameters["jump_mm"] < 1.3 * seen:
            return None
    return best


def _sized_foreign(thing: Foreign, experiment: Experiment, snr: float) -> Foreign:
    plant = replace(experiment.plant, hidden=(), foreign=thing)
    return replace(thing, size_mm=thing.size_mm * snr / max(ratio(plant, experiment), 1e-9))


def draw_experiment(seed: int, row: Row) -> Experiment:
    """Draw a random experiment of a row; the same seed gives the same experiment."""
    rng = np.random.default_rng([seed, *row.name.encode()])
    for _ in range(TRIES):
        try:
            return _draw(rng, row, seed)
        except NotDrawnError:
            continue
    raise NotDrawnError(f"Row {row.name} must be drawn within {TRIES} tries, but seed {seed} was not; use another.")


def _run_starts(rng: np.random.Generator, runs: int) -> tuple[float, ...]:
    at_an_end = rng.random(runs) < 2 / 3
    return tuple(float(v) for v in np.where(at_an_end, rng.choice([-1.0, 1.0], runs), rng.uniform(-1, 1, runs)))


def _draw(rng: np.random.Generator, row: Row, seed: int) -> Experiment:
    kind: Kind = row.kinds[rng.integers(len(row.kinds))]
    snr = float(rng.choice(row.snr))
    with_force = bool(rng.random() < 0.04)
    table, inputs = draw_table(rng, with_force=with_force)
    design = draw_design(rng, kind, inputs)
    slope = float(np.mean(np.abs(table.slope(np.linspace(inputs.lower_mm, inputs.upper_mm, 21)))))
    noise = draw_noise(rng, len(design.motions), slope, inputs.width_mm)
    total_s = sum(m.duration_s + design.pause_s for m in design.motions)
    placement = rng.uniform(-0.3, 0.3) if rng.random() < 0.5 else 0.0
    starts = _run_starts(rng, len(design.motions)) if row.free_start else ()
    bare = Plant(table, inputs, total_s=total_s, placement_mm=placement, run_start=starts)
    experiment = Experiment(bare, design, noise, snr, seed)
    among = row.names or NAMES
    names = [n for n in among if n != "hinge_stiffness_error" and not (design.time_restarts and n in CLOCKED)]
    if with_force and row.hidden and not row.names:
        names = ["hinge_stiffness_error"]
    if row.hidden > len(names) + len(row.beside):
        raise NotDrawnError("Force tables hide one effect.")
    hidden = []
    picked = [str(name) for name in rng.choice(names, 1 if row.beside else row.hidden, replace=False)]
    if row.beside:
        others = [n for n in row.beside if n not in picked and not (design.time_restarts and n in CLOCKED)]
        picked += [str(name) for name in rng.choice(others, row.hidden - 1, replace=False)]
    for name in picked:
        effect: Hidden | None = draw_hidden(rng, name, table, inputs, design, total_s)
        if snr > 0:
            effect = _sized(draw_hidden(rng, name, table, inputs, design, total_s), experiment, snr)
        if effect is None or not within_bounds(effect, table, inputs, design.rate_hz):
            raise NotDrawnError(f"{name} has no such size here.")
        hidden.append(effect)
    thing = None
    if row.foreign:
        begins = zip(experiment.starts_s(), design.motions, strict=True)
        within = [(start / total_s, (start + motion.duration_s) / total_s) for start, motion in begins]
        thing = _sized_foreign(draw_foreign(rng, within), experiment, snr)
    plant = replace(experiment.plant, hidden=tuple(hidden), foreign=thing)
    if snr == 0 and row.hidden and ratio(plant, experiment) < 3:
        raise NotDrawnError("An everyday size is at least three times the noise.")
    return replace(experiment, plant=plant)


def measured(experiment: Experiment, traces: list[Trace], rng: np.random.Generator) -> dict[str, list[Array]]:
    """Columns of the measured table, one array per run."""
    noise = experiment.noise
    columns: dict[str, list[Array]] = {key: [] for key in ("time_s", "input_mm", "left_mm", "right_mm", "force_n")}
    for trace in traces:
        errors = edge_errors(rng, noise, len(trace.input_mm))
        u = rounded(trace.input_mm + noise.input_mm * rng.standard_normal(len(trace.input_mm)), noise.encoder_step_mm)
        columns["time_s"].append(trace.run_time_s if experiment.design.time_restarts else trace.table_time_s)
        columns["input_mm"].append(u)
        columns["left_mm"].append(rounded(trace.left_mm + errors[0], noise.pixel_mm))
        columns["right_mm"].append(rounded(trace.right_mm + errors[1], noise.pixel_mm))
        columns["force_n"].append(trace.force_n + noise.force_n * rng.standard_normal(len(trace.input_mm)))
    return columns


def first_columns(experiment: Experiment) -> dict[str, list[Array]]:
    """Columns of the experiment's runs, with the same noise as in its table."""
    return measured(experiment, experiment.traces(), np.random.default_rng([experiment.seed, 7]))
