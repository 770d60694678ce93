"""The rows of the benchmark, by name."""

from collections.abc import Callable
from functools import partial

import numpy as np

from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.rows import (
    bad_input,
    commands_with_steps,
    encoder_jitter,
    end_stop,
    error_map,
    free_start,
    hours,
    iso_cycles,
    missing_directions,
    outside,
    polymer_creep,
    ripple,
    sparse,
    strokes,
    wind_up,
    wrong_sign,
)

ROWS: dict[str, Callable[[np.random.Generator], Rig]] = {
    "iso_cycles": iso_cycles.draw,
    "sparse": sparse.draw,
    "missing_directions": missing_directions.draw,
    "free_start": free_start.draw,
    "strokes": strokes.draw,
    "wind_up": wind_up.draw,
    "error_map": error_map.draw,
    "commands_with_steps": commands_with_steps.draw,
    "encoder_jitter": encoder_jitter.draw,
    "encoder_bar": encoder_jitter.draw_bar,
    "hours": hours.draw,
    "end_stop": end_stop.draw,
    "polymer_creep": polymer_creep.draw,
    "ripple": ripple.draw,
    "outside": outside.draw,
    "wrong_sign": wrong_sign.draw,
    "bad_input": bad_input.draw,
}
ENCODER_KINDS: dict[str, Callable[[np.random.Generator], Rig]] = {
    f"encoder_{'on' if true_zero else 'off'}_{jitter_um}um": partial(
        encoder_jitter.draw_kind, jitter_mm=1e-3 * jitter_um, true_zero=true_zero
    )
    for true_zero in (True, False)
    for jitter_um in (0, 1, 3)
}
"""Six kinds of encoder, used only on request (`--rows encoder_kinds`)."""
