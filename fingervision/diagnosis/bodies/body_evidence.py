"""Measured poses, gap and force as channels of one fit, each with the prediction of the drawing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction, known_channels
from fingervision.diagnosis.bodies.place_candidates import Candidate, candidates_of
from fingervision.diagnosis.bodies.place_search import PlaceFindings, PlaceSearch
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.models.drawn_mechanism import DrawnMechanism
from fingervision.models.place_answers import PlaceAnswers

Array = NDArray[np.float64]

GAP = "gap_mm"
FEWEST_ROWS = 20
"""Rows with every channel below which a noise of many channels is not known."""
LEAST_PRESENT = 0.5
"""Of the rows: a channel that is missing more often would cost the others too many."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyEvidence:
    """What the measured channels show beside the drawing.

    Parameters
    ----------
    prediction : BodyPrediction
        The drawing, in the channels that were compared, at the rows that have all of them.
    findings : PlaceFindings
        Which place.
    rows : ndarray of int, shape (k,)
        Those rows.
    names : tuple of str
        The channels as the table calls them.
    time_s : ndarray of float, shape (k,), or None
        Times of those rows; None where the table has none.
    """

    prediction: BodyPrediction
    findings: PlaceFindings
    rows: NDArray[np.intp]
    names: tuple[str, ...]
    time_s: Array | None = None


def drawing_of(model: CorrectedModel) -> PlaceAnswers | None:
    """Return the predictions of a model's drawing; None where the model has no drawing."""
    # isinstance would work the answers out to look for them.
    return cast(DrawnMechanism, model.base).places if hasattr(type(model.base), "places") else None


def body_evidence(
    table: MeasuredTable, answers: PlaceAnswers, input_mm: Array, rng: np.random.Generator
) -> tuple[BodyEvidence | None, tuple[str, ...]]:
    """Search for the hinge, link or pivot that explains a table's channels.

    Parameters
    ----------
    table : MeasuredTable
        With channels.
    answers : PlaceAnswers
        The drawing.
    input_mm : ndarray of float, shape (n,)
        What the mechanism received.
    rng : numpy Generator
        For thresholds.

    Returns
    -------
    evidence : BodyEvidence or None
        None where nothing can be compared.
    notes : tuple of str
        What a reader must know, a sentence each.
    """
    known, notes = known_channels(answers, tuple(table.channels)), []
    unknown = [name for name in table.channels if name not in known]
    if unknown:
        notes.append(f"not compared, for the model foretells no such channel: {', '.join(unknown)}.")
    scarce = [name for name in known if float(table.channels[name].present.mean()) < LEAST_PRESENT]
    if scarce:
        notes.append(f"not compared, for more than half of their readings are missing: {', '.join(scarce)}.")
    names = [name for name in known if name not in scarce]
    still = [name for name in names if np.ptp(table.channels[name].value[table.channels[name].present]) == 0.0]
    if still:
        notes.append(f"not compared, for they stand at one value in every row: {', '.join(still)}.")
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
    floors = [_floor(table.channels[name].value[rows], table.channels[name].u, rows) for name in names]
    drawn = [known[name] for name in names]
    if GAP in answers.channels:
        drawn.append(GAP)
        columns.append(table.gap_mm[rows])
        floors.append(_floor(table.gap_mm[rows], table.u_random_mm, rows))
    if table.force_n is not None and FORCE in answers.channels:
        drawn.append(FORCE)
        columns.append(table.force_n[rows])
        floors.append(_floor(table.force_n[rows], None, rows))
    prediction = BodyPrediction(answers, tuple(drawn), input_mm[rows])
    runs = _runs_among(table.runs, rows)
    search = PlaceSearch(prediction, np.stack(columns, axis=1), runs, np.array(floors), timed=table.time_s is not None)
    time_s = None if table.time_s is None else table.time_s[rows]
    return BodyEvidence(prediction, search.run(rng), rows, tuple(names), time_s), tuple(notes)


def _floor(values: Array, u: Array | None, rows: NDArray[np.intp]) -> float:
    """Smallest noise that is assumed for a channel: its stated uncertainty, or its last digit."""
    digit = resolution(values) / float(np.sqrt(12.0))
    return max(digit, 0.0 if u is None else float(np.median(u[rows])))


def _runs_among(runs: tuple[slice, ...], rows: NDArray[np.intp]) -> tuple[slice, ...]:
    ends = np.searchsorted(rows, [(run.start, run.stop) for run in runs])
    return tuple(slice(int(a), int(b)) for a, b in ends if b > a)


def added_everywhere(answers: PlaceAnswers, input_mm: Array, sizes: Mapping[str, float]) -> dict[str, Array] | None:
    """Changes that explanations make to every channel of a drawing, by full key.

    None where the drawing lacks one of them.

    Parameters
    ----------
    answers : PlaceAnswers
        The drawing.
    input_mm : ndarray of float, shape (n,)
        What the mechanism received.
    sizes : mapping of str to float
        Size of each explanation by its full key.
    """
    prediction = BodyPrediction(answers, answers.channels, input_mm)
    known: dict[str, Candidate] = {each.full_key: each for each in candidates_of(prediction)}
    if not set(sizes) <= set(known):
        return None
    total = sum((known[key].added(size) for key, size in sizes.items()), np.zeros_like(prediction.drawn))
    return {name: total[:, place] for place, name in enumerate(answers.channels)}
