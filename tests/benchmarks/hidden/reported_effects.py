"""Effects of a report.json, in the form of the benchmark's own measuring chain."""

from typing import Any

import numpy as np

from tests.benchmarks.hidden.candidates import Candidate
from tests.benchmarks.hidden.catalogue_chain import MAP, Effects


def reported_effects(report: dict[str, Any], known: list[Candidate]) -> Effects:
    """Values in the order of effects.md; the side of an end stop that is not reported lies at its bound.

    A map of position errors is left out, because its curve is in model.toml, not in the report.
    """
    by_name = {candidate.name: candidate for candidate in known}
    found: Effects = {}
    for effect in report["effects"]:
        if effect["name"] == MAP:
            continue
        candidate = by_name[effect["name"]]
        absent = dict(zip(candidate.names, np.zeros(len(candidate.names)), strict=True))
        if effect["name"] == "end_stop":
            absent = {"upper_mm": float(candidate.upper[0]), "lower_mm": float(candidate.lower[1])}
        given = {key: p["value"] for key, p in effect["parameters"].items()}
        unforeseen = set(given) - set(candidate.names)
        if unforeseen:
            raise ValueError(f"{effect['name']} must have the parameters {candidate.names}, but has {unforeseen} too.")
        found[effect["name"]] = np.array([given.get(key, absent[key]) for key in candidate.names], dtype=float)
    return found
