"""Metadata of a run: its files, recipe and test bed, and the simulated gap that is expected."""

import hashlib
import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from calib.measured_scale import Calibration
from fingervision import __version__
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.storage.run_files import CALIBRATION, EVENTS, SCHEMA, VIDEO
from fingervision.storage.simulation_table import write_simulation
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.motion.soft_limits import SoftLimits
from fingervision.testbed.simulation.injected_effects import Hidden

SAMPLES, SIMULATION, RECIPE, JOINED = "samples.csv", "simulation.csv", "recipe.toml", "joined.csv"
KIND = "bed run"
# Number of rows of simulation.csv, and its margin beyond the test bed's limits: readings in encoder steps may lie
# beyond them.
SIMULATED_ROWS, BEYOND_LIMITS_MM = 201, 0.06


def digest_of(bed: Bed, hidden: Hidden) -> str:
    """Hash that identifies a test bed and its injected effects without revealing them."""
    effects = {name: dict(sorted(values.items())) for name, values in sorted(hidden.effects.items())}
    return hashlib.sha256(json.dumps([bed.about, effects], sort_keys=True, default=str).encode()).hexdigest()


def write_expected(path: Path, model: Model, limits: SoftLimits) -> None:
    """Write the gap that the model predicts within the test bed's limits."""
    low_mm, high_mm = limits.lower_mm - BEYOND_LIMITS_MM, limits.upper_mm + BEYOND_LIMITS_MM
    inputs = np.linspace(low_mm, high_mm, SIMULATED_ROWS)
    # The force is left out, because it depends on the object between the fingers, not only on the gripper.
    write_simulation(path, inputs, replace(model.respond(inputs), force_n=None))


def about_run(recipe: Recipe[Section], bed: Bed, hidden: Hidden, began_at: datetime) -> dict[str, Any]:
    """Content of run.json at the start of a run."""
    camera = None if bed.camera is None else bed.camera.description
    return {
        "schema": SCHEMA,
        "kind": KIND,
        "software": {"name": "fingervision", "version": __version__},
        "name": recipe.name,
        "began_at": began_at.isoformat(timespec="milliseconds"),
        "recipe": recipe.text,
        "bed": dict(bed.about),
        "bed_digest": digest_of(bed, hidden),
        "device": None
        if camera is None
        else {
            "source": camera.name,
            "kind": camera.kind,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "rate_hz": camera.rate_hz,
            "notes": list(camera.notes),
        },
        "settings": {"below_tip_mm": bed.below_tip_mm, "tips": "auto", "roi": None},
        "scale": {
            "px_per_mm": None if bed.scale is None else bed.scale.px_per_mm,
            "calibration": CALIBRATION if isinstance(bed.scale, Calibration) else None,
        },
        "model": None if bed.model is None else SIMULATION,
        "video": VIDEO,
        "samples": SAMPLES,
        "events": EVENTS,
    }
