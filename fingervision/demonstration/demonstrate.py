"""Demonstration on the simulated test bed: add an effect, run, measure, diagnose, and execute the proposed next run."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.diagnosis.report.answer_files import NEXT_RUN, PAGE, write_answer
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.effects import catalogue
from fingervision.measuring.rehearsal import rehearse
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.storage.out_folder import make_out_folder, out_folder
from fingervision.storage.provenance import provenance
from fingervision.storage.recipe_toml import read_recipe, write_recipe
from fingervision.testbed.bed_factory import SIMULATED, open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.run.run_folder import (
    JOINED,
    SAMPLES,
    SIMULATION,
    contents,
    refuse_others,
    rows_before,
    times_of,
)
from fingervision.testbed.simulation.injected_effects import Hidden, usual_values

# The size of an effect is drawn at random between these multiples of its usual size.
SIZES = (0.6, 1.4)
# The first run has one opening and closing only, as for a gripper about which nothing is known yet.
FIRST_RUN: tuple[dict[str, object], ...] = (
    {"kind": "triangle", "from_mm": -0.4, "to_mm": 1.3, "speed_mm_s": 0.5, "cycles": 1, "frames": "continuous"},
)
MOST_RUNS = 3
Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Shown:
    """Outcome of a demonstration.

    Parameters
    ----------
    hidden : Hidden
        The effect that was hidden.
    report : DiagnosisReport
        Report of the last diagnosis.
    page : Path
        Path of the report in HTML.
    runs : int
        Number of runs that were made.
    """

    hidden: Hidden
    report: DiagnosisReport
    page: Path
    runs: int

    @property
    def among(self) -> bool:
        """Whether the effect that the demonstration added is in the ambiguity set of the diagnosis."""
        return any(set(names) == set(self.hidden.effects) for names in self.report.alternatives)

    @property
    def found(self) -> bool:
        """Whether the diagnosis named the effect that the demonstration added."""
        return {effect.name for effect in self.report.effects} == set(self.hidden.effects) and (
            self.report.verdict is (Verdict.NAMED if self.hidden.effects else Verdict.AGREES)
        )


def demonstrated() -> tuple[str, ...]:
    """Names of the effects that a few short runs can distinguish from all others."""
    return tuple(name for name, effect in catalogue().items() if effect.demonstrated)


def drawn(seed: int) -> Hidden:
    """Choose, by a seed, an effect and its size for the demonstration, among the effects declared suitable.

    A random number is drawn for each effect from the seed and the effect's name, and the effect with the highest number
    is chosen (rendezvous hashing: Thaler & Ravishankar 1998, doi:10.1109/90.663936). If an effect is added to the
    catalogue, the choice changes only for those seeds that choose the new effect.
    """
    rng = np.random.default_rng([seed, 7])
    name = max(demonstrated(), key=lambda name: float(np.random.default_rng([seed, crc32(name.encode())]).random()))
    effect = catalogue()[name]
    values = usual_values(effect)
    for p in effect.parameters:
        if p.neutral == 0.0:
            values[p.name] = float(np.clip(values[p.name] * rng.uniform(*SIZES), p.lower, p.upper))
    return Hidden({name: values})


def demonstrate(hidden: Hidden, seed: int, out: Path, say: Say) -> Shown:
    """Repeat diagnosis and proposed run until a single explanation remains, or no further run is proposed.

    Parameters
    ----------
    hidden : Hidden
        Effects hidden in the test bed; the demonstration does not use these effects before the end.
    seed : int
        Seed of all random numbers.
    out : Path
        Output folder, new or empty.
    say : callable
        Function called with one line of text for each step.

    Raises
    ------
    FingervisionError
        The folder cannot be written, or a run could not be made.
    """
    recipe = out / "recipe.toml"
    make_out_folder(out)
    if held := contents(out):
        refuse_others(out, held[0])
    write_recipe(recipe, "there and back", FIRST_RUN)
    rehearse()
    before: Path | None = None
    for number in range(1, MOST_RUNS + 1):
        folder, asked = out / f"run-{number}", read_recipe(recipe)
        say(f"Run {number}, {asked.name}: the stage moves, a camera films the gripper, and every picture is measured.")
        rows = [] if before is None else rows_before(before)
        bed = open_bed(SIMULATED, hidden, seed=seed, earlier_s=times_of(rows))
        try:
            done = run_recipe(asked, bed, folder, hidden, before=rows)
        finally:
            bed.close()
        say(
            f"{done.counts.with_gap} gaps were measured in {done.counts.recorded} pictures. The gaps are compared with "
            "the simulation."
        )
        table = folder / (SAMPLES if before is None else JOINED)
        answer, page = _answer(table, folder / SIMULATION, out / f"diagnosis-{number}", seed)
        say(f"{answer.report.verdict}: {answer.report.sentence}")
        settled = answer.report.verdict in (Verdict.NAMED, Verdict.AGREES)
        if settled or answer.report.next_run is None or number == MOST_RUNS:
            break
        say(f"Next: {answer.report.next_run.words}")
        before, recipe = folder, out / f"diagnosis-{number}" / NEXT_RUN
    return Shown(hidden, answer.report, page, number)


def _answer(table: Path, simulation: Path, out: Path, seed: int) -> tuple[Diagnosis, Path]:
    """Diagnose a table, and write the same files as `fingervision diagnose`."""
    model = read_model(simulation)
    done = diagnose(read_measured_table(table), model, seed=seed)
    with out_folder(out):
        made = provenance({"measured table": table, "model": simulation})
        write_answer(out, done, model, made, table)
    return done, out / PAGE
