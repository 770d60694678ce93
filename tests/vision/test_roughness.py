"""Rough edges: estimated deviation and correlation length for random waves with known values, and resulting
uncertainties.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from fingervision.domain.camera import Roughness
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.finger_end import FingerEnd, fit_finger_end
from fingervision.vision.first_guess import first_guess
from fingervision.vision.gap import TOO_ROUGH, specimen_roughness
from fingervision.vision.measuring_point import measuring_point, squared
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame, steps_alone
from fingervision.vision.roughness import best_linear, is_surer, roughness, with_roughness
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, plain, texture
from tests.benchmarks.camera_artefacts.optics import Surface

U_POINT, WIDTH, BLUR = 0.05, 90.0, 1.0


def finger(rng: np.random.Generator, deviation: float, length: float) -> tuple[OutlinePoints, FingerEnd]:
    """A finger with sharp corners and independent waves on every side, with the correlation exp(-d^2 / 2 length^2)."""

    def waves(count: int) -> np.ndarray:
        place = np.arange(count)
        covariance = deviation**2 * np.exp(-0.5 * ((place[:, None] - place) / max(length, 1e-3)) ** 2)
        lower = np.linalg.cholesky(covariance + U_POINT**2 * np.eye(count))
        return lower @ rng.standard_normal(count)

    rows, columns = np.arange(4.0, 64.0), np.arange(-WIDTH + 4.0, -3.0)
    x = np.concatenate((waves(60), columns, -WIDTH + waves(60)))
    y = np.concatenate((rows, waves(columns.size), rows))
    side = np.repeat([0, 1, 2], [60, columns.size, 60])
    points = OutlinePoints(x, y, np.full(x.size, U_POINT), side, np.full(x.size, BLUR))
    return points, fit_finger_end(points, *first_guess(points, 10.0))


def found(rng: np.random.Generator, deviation: float, length: float) -> Roughness | None:
    (left, left_end), (right, right_end) = (finger(rng, deviation, length) for _ in range(2))
    return roughness((left, right), (left_end, right_end))


@pytest.mark.parametrize("length", [1.5, 3.0, 4.0])
def test_waves_give_back_what_they_were_drawn_with(length: float) -> None:
    """Four flanks of 60 points have n = 240 / (2.5 length) independent waves, which determine the deviation to 1 /
    sqrt(2 n). The program assumes another correlation function than the drawn Gaussian one.
    """
    deviation, waves = 0.25, 240.0 / (np.sqrt(2.0 * np.pi) * length)
    rng = np.random.default_rng(int(10 * length))
    seen = [found(rng, deviation, length) for _ in range(12)]
    values = np.array([one.deviation_px for one in seen if one is not None])
    assert len(values) == 12
    # The product's process has longer tails than a Gaussian's: up to 1.5 times wide, never narrow.
    u_mean = deviation / np.sqrt(2.0 * waves * 12)
    assert deviation - 3.0 * u_mean < values.mean() < 1.5 * deviation + 3.0 * u_mean
    shared = np.array([one.shared_px for one in seen if one is not None])
    assert 0.8 < np.median(shared) / (np.sqrt(2.0 * np.pi) * length) < 2.0


def rounded(rng: np.random.Generator, errors: Roughness, radius: float) -> tuple[OutlinePoints, OutlinePoints]:
    """A finger with fillets, displaced along its normals by waves of a given covariance, without and with their
    uncertainty.
    """
    rows, columns = np.arange(0.3 * radius, 64.0, 2.0), np.arange(-WIDTH + 0.3 * radius, -0.3 * radius + 1.0, 2.0)

    def inset(d: np.ndarray) -> np.ndarray:
        return np.asarray(radius - np.sqrt(np.maximum(radius**2 - np.maximum(radius - d, 0.0) ** 2, 0.0)))

    x = np.concatenate((-inset(rows), columns, -WIDTH + inset(rows)))
    y = np.concatenate((rows, inset(np.minimum(-columns, columns + WIDTH)), rows))
    side = np.repeat([0, 1, 2], [rows.size, columns.size, rows.size])
    u, blur = np.full(x.size, U_POINT), np.full(x.size, 0.3)
    shape = np.array((0.0, -WIDTH, 0.0, 0.0, radius, radius, 0.0, 0.0))
    end = FingerEnd(shape, np.eye(8), np.zeros(2), 1.0, np.zeros(x.size), np.ones(x.size))
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    covariance = np.interp(distance, np.arange(errors.covariance.size), errors.covariance, right=0.0)
    waves = np.linalg.cholesky(covariance + 1e-4 * np.eye(x.size)) @ rng.standard_normal(x.size)
    inside = np.column_stack((np.clip(x, -WIDTH + radius, -radius), np.maximum(y, radius)))
    normal = np.column_stack((x, y)) - inside
    normal /= np.hypot(*normal.T)[:, None]
    along_line = waves / np.where(side == 1, normal[:, 1], normal[:, 0])
    moved = OutlinePoints(x + np.where(side == 1, 0, along_line), y + np.where(side == 1, along_line, 0), u, side, blur)
    return moved, with_roughness(moved, errors, end)


def test_a_rough_fillet_is_as_sure_as_it_says() -> None:
    """Errors of tip and edge on a slanted fillet with waves of known covariance, in stated uncertainties."""
    errors = Roughness(0.3**2 * np.exp(-0.5 * (np.arange(65.0) / 4.0) ** 2))
    rng, below, radius = np.random.default_rng(21), 6.0, 25.0
    truth = np.array((0.0, np.sqrt(radius**2 - (radius - below) ** 2) - radius))
    squares = []
    for _ in range(150):
        bare, points = rounded(rng, errors, radius)
        start, origin, u_prior = first_guess(points, below)
        end = best_linear(points, fit_finger_end(points, start, origin, u_prior), start, u_prior, bare, errors)
        read = measuring_point(squared(end), below, 0.3)
        squares.append((np.array((read.tip, read.edge)) - truth) ** 2 / np.diag(read.covariance))
    # Chi-square of 150 lies between 106 and 202 in 99.4 of 100 cases.
    assert np.all(np.sum(squares, axis=0) > 106.0)
    assert np.all(np.sum(squares, axis=0) < 202.0)


def test_a_row_sees_more_of_roughness_on_a_slant() -> None:
    """On a fillet at 45 degrees, a point moves along its row by sqrt(2) times the edge's normal displacement."""
    errors, radius = Roughness(0.3**2 * np.exp(-0.5 * (np.arange(65.0) / 4.0) ** 2)), 25.0
    points = rounded(np.random.default_rng(1), errors, radius)[1]
    at_45 = np.argmin(np.abs(points.y[points.side == 0] - (1.0 - np.sqrt(0.5)) * radius))
    assert points.u[at_45] == pytest.approx(np.hypot(U_POINT, 0.3 * np.sqrt(2.0)), rel=0.1)


def test_noise_alone_is_not_rough() -> None:
    rng = np.random.default_rng(3)
    assert all(found(rng, 0.0, 1.0) is None for _ in range(20))


def test_a_recording_tells_the_roughness_of_its_edges() -> None:
    """Frames with waves of 0.3 px tell it together; from smooth ones nothing is learnt."""
    settings, rng = Settings(BELOW_PX, Direction.UP, camera=LINEAR_CAMERA), np.random.default_rng(41)
    learnt = []
    for rough_px in (0.3, 0.0):
        frames = [Frame(plain(rng, Surface(rough_px=rough_px)).picture, k) for k in range(4)]
        looks = [look for frame in frames if (look := steps_alone(frame, settings)) is not None]
        learnt.append(specimen_roughness([(fingers, edges) for (_, edges), _, fingers in looks], BELOW_PX))
    rough, smooth = learnt
    assert smooth is None
    assert rough is not None
    assert 0.2 < rough.deviation_px < 0.45
    shot = plain(rng, Surface(rough_px=0.3))
    known = replace(settings, camera=replace(settings.camera, roughness=rough))
    found = measure_frame(Frame(shot.picture, 0), known)
    assert isinstance(found, GapMeasurement)
    assert found.roughness_px == pytest.approx(rough.deviation_px)
    assert abs(found.gap_px - shot.gap_px) < 3.0 * np.hypot(found.u_gap_px, found.u_picture_px)


def test_longer_flanks_count_where_they_agree() -> None:
    near = measured_plain()
    surer = GapMeasurement(near.left, near.right, near.direction, 0.5 * near.u_gap_px, near.light_gap)
    assert is_surer(surer, near)
    assert not is_surer(near, surer)
    assert not is_surer(replace(surer, right=replace(near.right, x_px=near.right.x_px + 1.0)), near)


def test_longer_flanks_count_where_the_near_ones_are_too_short_to_tell() -> None:
    near = replace(measured_plain(), roughness_px=np.nan)
    rough = replace(near, u_gap_px=10.0 * near.u_gap_px, roughness_px=0.3)
    assert is_surer(rough, near)
    assert not is_surer(replace(near, roughness_px=0.0), near)


def test_flanks_too_short_to_tell_are_not_taken_for_smooth() -> None:
    """A parabola explains sixteen points of a rough flank about equally well, which does not prove that there is no
    roughness.
    """
    rng, untold = np.random.default_rng(8), 0
    for _ in range(10):
        (left, left_end), (right, right_end) = (finger(rng, 0.25, 4.0) for _ in range(2))
        short = []
        for points in (left, right):
            near = points.is_row & (points.y < 20.0) | ~points.is_row
            x, y, u, blur = (values[near] for values in (points.x, points.y, points.u, points.blur))
            short.append(OutlinePoints(x, y, u, points.side[near], blur))
        ends = [fit_finger_end(p, *first_guess(p, 10.0)) for p in short]
        told = roughness((short[0], short[1]), (ends[0], ends[1]))
        untold += told is not None and not told.is_told
        told = roughness((left, right), (left_end, right_end))
        assert told is not None
        assert told.is_told
    assert untold >= 1


def measured_plain() -> GapMeasurement:
    shot = plain(np.random.default_rng(1), Surface())
    outcome = measure_frame(Frame(shot.picture, 0), Settings(BELOW_PX, Direction.UP, camera=LINEAR_CAMERA))
    assert isinstance(outcome, GapMeasurement)
    assert outcome.roughness_px == 0.0
    return outcome


@pytest.mark.slow
@pytest.mark.parametrize(("rough_px", "rms_px"), [(0.0, 0.25), (0.3, 0.6)])
def test_a_printed_finger_is_as_sure_as_it_says(rough_px: float, rms_px: float) -> None:
    """Twelve pictures of the third renderer: errors in units of the stated uncertainty, and at most a tenth refused."""
    rng = np.random.default_rng([9, int(10 * rough_px)])
    draw = partial(texture, rough_px=rough_px)
    errors, ratios = [], []
    for _ in range(12):
        shot = draw(rng)
        outcome = measure_frame(Frame(shot.picture, 0), Settings(BELOW_PX, Direction.UP, camera=LINEAR_CAMERA))
        if outcome == TOO_ROUGH:
            continue
        assert isinstance(outcome, GapMeasurement), outcome
        errors.append(outcome.gap_px - shot.gap_px)
        ratios.append(errors[-1] / outcome.u_gap_px)
    assert len(errors) >= 11
    assert np.sqrt(np.mean(np.square(errors))) < rms_px
    # Twelve ratios of unit variance: chi-square of 12 lies below 28 in 99.5 of 100 cases.
    assert np.sum(np.square(ratios)) < 28.3
