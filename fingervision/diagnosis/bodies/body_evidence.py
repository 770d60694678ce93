"""Compare measured poses, gap and force with the drawing's predictions, as channels of one joint fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction, known_channels
from fingervision.diagnosis.bodies.place_candidates import Candidate, candidates_of
from fingervision.diagnosis.bodies.place_findings import PlaceFindings
from fingervision.diagnosis.bodies.place_search import PlaceSearch
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.models.physical_gripper import DrawnMechanism
from fingervision.models.place_answers import PlaceAnswers

Array = NDArray[np.float64]

GAP = "gap_mm"
FEWEST_ROWS = 20
"""Least number of rows with every channel; with fewer, the noise covariance of the channels cannot be estimated."""
LEAST_PRESENT = 0.5
"""Least share of rows in which a channel must be present: a row without this channel is not used for any channel."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyEvidence:
    """Results of comparing the measured channels with the drawing.

    Parameters
    ----------
    prediction : BodyPrediction
        Predictions of the drawing for the compared channels, at the rows that have all of these channels.
    findings : PlaceFindings
        Faulty hinge, link or pivot, if there is one.
    rows : ndarray of int, shape (k,)
        Indices of the rows that have all compared channels.
    names : tuple of str
        Names of the channels in the table.
    time_s : ndarray of float, shape (k,), or None
        Times of these rows; None if the table has no times.
    """

    prediction: BodyPrediction
    findings: PlaceFindings
    rows: NDArray[np.intp]
    names: tuple[str, ...]
    time_s: Array | None = None


def drawing_of(model: CorrectedModel) -> PlaceAnswers | None:
    """Return the object that predicts from a model's drawing; None if the model has no drawing."""
    # isinstance would compute the predictions only to test whether they exist.
    return cast(DrawnMechanism, model.base).places if hasattr(type(model.base), "places") else None


def body_evidence(
    table: MeasuredTable, answers: PlaceAnswers, input_mm: Array, rng: np.random.Generator
) -> tuple[BodyEvidence | None, tuple[str, ...]]:
    """Search for the hinge, link or pivot whose change explains the measured channels of a table.

    Parameters
    ----------
    table : MeasuredTable
        Table with channels.
    answers : PlaceAnswers
        Predictions of the drawing.
    input_mm : ndarray of float, shape (n,)
        Input that the mechanism received.
    rng : numpy Generator
        Generator for the simulation of thresholds.

    Returns
    -------
    evidence : BodyEvidence or None
        None if no channel can be compared.
    notes : tuple of str
        Remarks that a reader must know, one sentence each.
    """
    known, notes = known_channels(answers, tuple(table.channels)), []
    unknown = [name for name in table.channels if name not in known]
    if unknown:
        notes.append(f"not compared, because the model does not predict them: {', '.join(unknown)}.")
    scarce = [name for name in known if float(table.channels[name].present.mean()) < LEAST_PRESENT]
    if scarce:
        notes.append(f"not compared, because more than half of their readings are missing: {', '.join(scarce)}.")
    names = [name for name in known if name not in scarce]
    still = [name for name in names if np.ptp(table.channels[name].value[table.channels[name].present]) == 0.0]
    if still:
        notes.append(f"not compared, because they have the same value in every row: {', '.join(still)}.")
    names = [name for name in names if name not in still]
    if not names:
        return None, tuple(notes)
    present = np.logical_and.reduce([table.channels[name].present for name in names])
    rows = np.flatnonzero(present)
    if rows.size < FEWEST_ROWS:
        notes.append(
            f"poses of bodies were not compared: {FEWEST_ROWS} rows must have all of {', '.join(names)}, but "
            f"{rows.size} have."
        )
        return None, tuple(notes)
    columns = [table.channels[name].value[rows] for name in names]
    floors = [noise_floor(table.channels[name].value[rows], table.channels[name].u, rows) for name in names]
    drawn = [known[name] for name in names]
    if GAP in answers.channels and not table.followed:
        drawn.append(GAP)
        columns.append(table.gap_mm[rows])
        floors.append(noise_floor(table.gap_mm[rows], table.u_random_mm, rows))
    if table.force_n is not None and FORCE in answers.channels:
        drawn.append(FORCE)
        columns.append(table.force_n[rows])
        floors.append(noise_floor(table.force_n[rows], None, rows))
    prediction = BodyPrediction(answers, tuple(drawn), input_mm[rows])
    runs = runs_among(table.runs, rows)
    search = PlaceSearch(prediction, np.stack(columns, axis=1), runs, np.array(floors), timed=table.time_s is not None)
    time_s = None if table.time_s is None else table.time_s[rows]
    return BodyEvidence(prediction, search.run(rng), rows, tuple(names), time_s), tuple(notes)


def compared_name(table: MeasuredTable, answers: PlaceAnswers) -> str:
    """Name, in the drawing, of what the table's gap is: the gap, or the displacement of a body that stands for it."""
    return known_channels(answers, (table.followed,))[table.followed] if table.followed else GAP


def noise_floor(values: Array, u: Array | None, rows: NDArray[np.intp]) -> float:
    """Smallest noise assumed for a channel: its stated uncertainty, or the rounding of its last digit."""
    digit = resolution(values) / float(np.sqrt(12.0))
    return max(digit, 0.0 if u is None else float(np.median(u[rows])))


def runs_among(runs: tuple[slice, ...], rows: NDArray[np.intp]) -> tuple[slice, ...]:
    """Runs among the rows that are used; runs without such rows are left out."""
    ends = np.searchsorted(rows, [(run.start, run.stop) for run in runs])
    return tuple(slice(int(a), int(b)) for a, b in ends if b > a)


def added_everywhere(answers: PlaceAnswers, input_mm: Array, sizes: Mapping[str, float]) -> dict[str, Array] | None:
    """Change of every channel caused by given explanations of the drawing, by the key of the explanation.

    The function returns None if the drawing does not contain the place of one of the explanations.

    Parameters
    ----------
    answers : PlaceAnswers
        The drawing.
    input_mm : ndarray of float, shape (n,)
        Input that the mechanism received.
    sizes : mapping of str to float
        Size of each explanation by its full key.
    """
    prediction = BodyPrediction(answers, answers.channels, input_mm)
    known: dict[str, Candidate] = {each.full_key: each for each in candidates_of(prediction)}
    if not set(sizes) <= set(known):
        return None
    total = sum((known[key].added(size) for key, size in sizes.items()), np.zeros_like(prediction.drawn))
    return {name: total[:, place] for place, name in enumerate(answers.channels)}
