"""Files of a simulated table: measured.csv, simulation.csv and truth.json, in the form that score.py reads."""

import json
from pathlib import Path

import numpy as np

from tests.benchmarks.world.candidates import MAP
from tests.benchmarks.world.definitions import respond
from tests.benchmarks.world.nearest import Judge
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.right_answers import FAR, RightAnswers

SIZE_SHARE, SIZE_SIGMAS = 0.15, 3.0
"""Tolerances of a right size: 15 % (for another formula of the same effect) or three standard deviations of the best
fit."""


def _lines(header: list[str], columns: list[list[str]]) -> str:
    return "\n".join([",".join(header), *(",".join(row) for row in zip(*columns, strict=True))]) + "\n"


def write_tables(rig: Rig, folder: Path) -> None:
    """Write measured.csv and simulation.csv; a row without a reading has an empty gap."""
    folder.mkdir(parents=True, exist_ok=True)
    header, columns = [], []
    if len(np.unique(rig.run)) > 1:
        header, columns = ["run"], [[str(r) for r in rig.run]]
    header += ["time_s", "input_mm", "gap_mm"]
    columns += [[f"{t:.4f}" for t in rig.time_s], [f"{u:.7f}" for u in rig.input_mm]]
    columns.append([f"{g:.7f}" if r else "" for g, r in zip(rig.gap_mm, rig.read, strict=True)])
    (folder / "measured.csv").write_text(_lines(header, columns), encoding="utf-8")
    rows = [[f"{v:.7f}" for v in column] for column in (rig.simulation.input_mm, rig.simulation.gap_mm)]
    (folder / "simulation.csv").write_text(_lines(["input_mm", "gap_mm"], rows), encoding="utf-8")


def sizes(rig: Rig, judge: Judge, right: RightAnswers) -> dict[str, dict[str, float]]:
    """Parameters of each required effect by the catalogue's formula, with a tolerance."""
    names = [n for n in right.parameters if n in judge.known]
    values = [right.parameters[n] for n in names]
    cuts = np.cumsum([v.size for v in values])[:-1]
    flat = np.concatenate(values) if values else np.zeros(0)
    start = judge.nearest(frozenset(names), right.parameters).start if names else np.zeros(rig.runs)

    def curve(x: np.ndarray) -> np.ndarray:
        return respond(rig, dict(zip(names, np.split(x, cuts), strict=True)), start) / judge.sd_mm

    columns = []
    for i, v in enumerate(flat):
        step = np.zeros(flat.size)
        step[i] = 1e-3 * abs(v) + 1e-7
        columns.append((curve(flat + step) - curve(flat - step)) / (2 * step[i]))
    found: dict[str, dict[str, float]] = {}
    if flat.size:
        matrix = np.array(columns).T
        sd = np.sqrt(np.abs(np.diag(np.linalg.pinv(matrix.T @ matrix))))
        labels = [p for n in names for p in judge.known[n].names]
        owners = [n for n in names for _ in judge.known[n].names]
        for owner, label, v, s in zip(owners, labels, flat, sd, strict=True):
            drawn = next(h.parameters for h in rig.hidden if h.name == owner)
            if owner in right.needed and (label in drawn or owner != "end_stop"):
                found[label] = {"value": float(v), "tolerance": float(max(SIZE_SHARE * abs(v), SIZE_SIGMAS * s))}
    for h in rig.hidden:
        if h.name == MAP and MAP in right.needed:
            rms = h.parameters["rms_mm"]
            found["rms_mm"] = {"value": rms, "tolerance": 0.25 * rms + 3 * rig.noise_mm / 3}
    return found


def pure_error_mm(rig: Rig) -> float | None:
    """Pooled scatter of readings at one position approached from one side; None in motion or without repeats."""
    u = rig.input_mm
    way = np.sign(np.diff(u, prepend=u[0] - 1e-9))
    for i in range(1, way.size):
        way[i] = way[i] or way[i - 1]
    keys = np.stack([np.round(u, 6), way], axis=1)[rig.read]
    gap = rig.gap_mm[rig.read]
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    counts = np.bincount(group)
    free = int(np.sum(counts[counts > 1] - 1))
    if free < 5 or not rig.path.at_rest:
        return None
    means = np.bincount(group, gap) / counts
    return float(np.sqrt(np.sum((gap - means[group]) ** 2) / free))


def truth_of(rig: Rig, judge: Judge, right: RightAnswers, numbers: dict[str, object]) -> dict[str, object]:
    """Content of truth.json: the keys used for measured tables, then keys of simulated tables only."""
    noise = rig.gap_mm[rig.read] - rig.clean_gap_mm[rig.read]
    form = right.own / noise.size * float(np.mean(judge.sd_mm**2))
    bare = rig.gap_mm[rig.read] - rig.simulation.gap(rig.input_mm[rig.read])
    core = [sorted(c) for c in right.core]
    alternatives = [{"core": core, "also_allowed": sorted(right.allowed), "reason": "what acts in the drawn rig"}]
    must_not = ["agrees"] if right.nothing > FAR and not rig.may_agree else []
    if right.nothing <= FAR and core:
        alternatives.append({"core": [], "also_allowed": sorted(right.allowed), "reason": "too small to be seen"})
    if rig.wrong_sign:
        alternatives = []
        must_not += sorted(judge.known)
    return {
        "source": f"tests.benchmarks.world, {rig.kind}",
        "licence": "drawn",
        "kind": rig.kind,
        "certainty": "sure",
        "known": [rig.note] if rig.note else [],
        "effects_right": alternatives,
        "must_not": must_not,
        "outside_structure": rig.outside,
        "pure_error_mm": pure_error_mm(rig),
        "before_rms_mm": float(np.sqrt(np.mean(bare**2))),
        "reachable_rms_mm": float(np.sqrt(np.mean(noise**2) + form)),
        "sizes": sizes(rig, judge, right),
        "rows": int(rig.read.size),
        "rows_with_gap": int(rig.read.sum()),
        "drawn_from": numbers,
        "hidden": [{"name": h.name, "parameters": _parameters(h.name, h.parameters, judge, right)} for h in rig.hidden],
        "drawn": [{"name": h.name, "parameters": h.parameters} for h in rig.hidden],
        "needed": sorted(right.needed),
        "exact_forms": rig.exact_forms and not rig.outside,
        "wrong_sign": rig.wrong_sign,
        "may_refuse": rig.may_refuse,
        "noise_mm": rig.noise_mm,
        "noise_with_input_mm": float(np.sqrt(np.mean(judge.sd_mm**2))),
        "distance_of_nothing": right.nothing,
        "distance_of_truth": right.own,
    }


def _parameters(name: str, drawn: dict[str, float], judge: Judge, right: RightAnswers) -> dict[str, float]:
    if name not in right.parameters:
        return drawn
    fitted = dict(zip(judge.known[name].names, (float(v) for v in right.parameters[name]), strict=True))
    # An end stop has two sides, of which only one is simulated.
    return {key: v for key, v in fitted.items() if key in drawn or name != "end_stop"}


def write(rig: Rig, judge: Judge, right: RightAnswers, numbers: dict[str, object], folder: Path) -> None:
    """Write the three files."""
    write_tables(rig, folder)
    truth = truth_of(rig, judge, right, numbers)
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
