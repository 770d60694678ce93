"""User-named columns (channels) of a measured table: `name_mm`, `name_mrad`, and their `u_` and `u_random_` columns."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from fingervision.domain.measured_table import Channel
from fingervision.storage.number_columns import Numbers

UNITS = ("_mm", "_mrad")
U_PREFIXES = ("u_random_", "u_")
"""Prefixes of columns with standard uncertainties of a channel, in order of preference: the random part if the table
states it, otherwise the total, as with `u_random_mm` and `u_gap_mm` of the gap."""
NO_CHANNELS = ("held_mm", "target_mm", "encoder_mm", "u_force_n")
"""Columns of fingervision's own tables whose names end like those of channels, but that are not channels."""


def channel_names(names: Sequence[str], taken: Collection[str]) -> list[str]:
    """Select from a table's header the names of channels, and of `u_` columns that belong to a channel."""
    found = [
        name
        for name in names
        if name.endswith(UNITS) and not name.startswith("u_") and name not in taken and name not in NO_CHANNELS
    ]
    return [*found, *(f"{u}{name}" for u in U_PREFIXES for name in found if f"{u}{name}" in names)]


def channels_of(values: Mapping[str, Numbers], rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> dict[str, Channel]:
    """Select given rows of the channels in a given order; `u_` columns without valid uncertainties are omitted."""
    found = {}
    for name, numbers in values.items():
        if name.startswith("u_") or not numbers.present[rows].any():
            continue
        present = numbers.present[rows]
        stated = None
        for u in (values[f"{prefix}{name}"] for prefix in U_PREFIXES if f"{prefix}{name}" in values):
            if u.present[rows][present].all() and np.all(u.value[rows][present] >= 0.0):
                stated = u.value[rows]
                break
        found[name] = Channel(numbers.value[rows], present, stated)
    return found
