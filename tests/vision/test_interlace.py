"""Interlaced pictures, compared with separately drawn fields, and pictures that are not interlaced."""

from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame
from tests.benchmarks.camera_artefacts import electronics as e
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, NOISE, SIZE_PX, Shot, gripper, interlaced, plain
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import true_gap

KNOWN = Settings(BELOW_PX, Direction.UP, camera=LINEAR_CAMERA)


def measured(shot: Shot, settings: Settings = KNOWN) -> GapMeasurement:
    found = measure_frame(Frame(shot.picture, 0), settings)
    assert isinstance(found, GapMeasurement), found
    return found


def fields(rng: np.random.Generator, apart_px: float) -> Shot:
    """The right finger moves by a given distance from the even rows' time to the odd rows'; the truth is half-way."""
    left, right = gripper(rng)
    even, odd = (
        light_on_sensor((left, replace(right, across_px=right.across_px + by)), Surface(), 1.0, SIZE_PX, rng)
        for by in (-0.5 * apart_px, 0.5 * apart_px)
    )
    even[1::2] = odd[1::2]
    return Shot(e.stored(e.noisy(even, NOISE, rng)), true_gap(left, right, BELOW_PX))


@pytest.mark.parametrize("apart_px", [0.4, 1.0, 2.0, 4.0])
def test_fields_are_seen_apart_and_measured_half_way(apart_px: float) -> None:
    rng = np.random.default_rng([4, int(10 * apart_px)])
    shot = fields(rng, apart_px)
    found = measured(shot)
    assert found.fields_apart_px == pytest.approx(apart_px, abs=0.05 + 0.02 * apart_px)
    assert abs(found.gap_px - shot.gap_px) < 3.0 * np.hypot(found.u_gap_px, found.u_shift_px)
    assert np.hypot(found.u_gap_px, found.u_shift_px) < 0.06 * max(apart_px, 1.0)


def test_as_the_benchmark_draws_them() -> None:
    rng = np.random.default_rng(6)
    errors = [measured(shot).gap_px - shot.gap_px for shot in (interlaced(rng) for _ in range(2))]
    assert np.sqrt(np.mean(np.square(errors))) < 0.06


def test_a_picture_turned_over_has_fields_as_well() -> None:
    shot = fields(np.random.default_rng(2), 1.0)
    turned = measured(replace(shot, picture=shot.picture[::-1].copy()), replace(KNOWN, direction=Direction.DOWN))
    assert turned.gap_px == pytest.approx(measured(shot).gap_px, abs=0.01)
    assert turned.fields_apart_px == pytest.approx(1.0, abs=0.07)


def test_a_plain_picture_has_none() -> None:
    rng = np.random.default_rng(5)
    assert all(measured(plain(rng, Surface())).fields_apart_px == 0.0 for _ in range(2))
