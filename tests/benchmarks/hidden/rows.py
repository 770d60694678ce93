"""Rows of the table in section 5 of diagnosing.md."""

from tests.benchmarks.hidden.catalogue_chain import MAP
from tests.benchmarks.hidden.experiment import Row
from tests.benchmarks.hidden.sizes import WITH_START

OFFSETS = ("input_offset", "rest_gap_error", "edge_bias")
"""Effects to which a play that is engaged throughout a run is equivalent."""
BESIDE = ("rest_gap_error", "drive_lag", "input_scale", "viscoelastic_creep", "thermal_drift", "encoder_cyclic_error")
"""Effects that are simulated together with a play or a friction."""

ROWS = {
    row.name: row
    for row in (
        Row("null", ("rich", "ordinary"), 0, False, (1.0,)),
        Row("single_3", ("rich",), 1, False, (3.0,)),
        Row("single_1", ("rich",), 1, False, (1.0,)),
        Row("single_03", ("rich",), 1, False, (0.3,)),
        Row("single_everyday", ("rich",), 1, False, (0.0,)),
        Row("ordinary", ("ordinary",), 1, False, (1.0, 3.0)),
        Row("outside", ("rich",), 0, True, (1.0, 3.0)),
        Row("pair_3", ("rich",), 2, False, (3.0,)),
        Row("pair_1", ("rich",), 2, False, (1.0,)),
        Row("poor", ("poor",), 1, False, (1.0, 3.0)),
        # Rows with random start states, maps, and speed limits, which were added later.
        Row("start_3", ("rich",), 1, False, (3.0,), WITH_START, free_start=True),
        Row("start_1", ("rich",), 1, False, (1.0,), WITH_START, free_start=True),
        Row("start_ordinary", ("ordinary",), 1, False, (1.0, 3.0), WITH_START, free_start=True),
        Row("start_poor", ("poor",), 1, False, (1.0, 3.0), (*WITH_START, *OFFSETS), free_start=True),
        Row("start_pair", ("rich",), 2, False, (3.0,), WITH_START, BESIDE, free_start=True),
        Row("map", ("rich", "ordinary"), 1, False, (1.0, 3.0), (MAP,)),
        Row("map_pair", ("rich",), 2, False, (3.0,), (MAP,), (*WITH_START, "drive_lag"), free_start=True),
        Row("slew", ("rich",), 1, False, (1.0, 3.0), ("slew_limit",)),
    )
}
