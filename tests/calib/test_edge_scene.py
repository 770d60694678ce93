"""What stands beside an edge is told from the profiles of all flanks together, drawn here by integrating the light."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import erfc

from calib.edge_profile import EdgeProfile
from calib.edge_response import probabilities
from calib.edge_scene import NOTHING, PAIRS, SCENES, Scene
from calib.scene_fit import fit_scenes, is_more_beside
from calib.tone_curves import family

Floats = NDArray[np.float64]

FINE_PX, BLUR_PX, NOISE = 0.01, 1.1, 0.0015
DARK, LIGHT = 0.08, 0.7
# Direction towards the ground, and whether the flank is an outer one: left finger, then right finger.
FLANKS = ((1.0, False), (-1.0, True), (-1.0, False), (1.0, True))


def nothing(t: Floats, is_outer: bool) -> Floats:
    return np.where(t > 0.0, LIGHT, DARK)


def wall(t: Floats, is_outer: bool) -> Floats:
    return np.where((t > 0.0) & (t < 2.5) & (not is_outer), 0.4, nothing(t, is_outer))


def line(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) + np.where((t < -1.0) & (t > -2.2), 0.4, 0.0)


def shadow(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) * np.where(t > 0.0, 1.0 - 0.35 * np.clip(1.0 - t / 7.0, 0.0, 1.0), 1.0)


def contact(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) * np.where(t > 0.0, 1.0 - 0.5 * np.exp(-np.maximum(t, 0.0) / 4.0), 1.0)


def wall_and_line(t: Floats, is_outer: bool) -> Floats:
    return wall(t, is_outer) + np.where((t < -1.0) & (t > -2.2), 0.4, 0.0)


def chamfer(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) + np.where((t < 0.0) & (t > -2.0), 0.37, 0.0)


def polished_inside(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) + np.where((t < -0.8) & (t > -2.3) & (not is_outer), 0.35, 0.0)


def sheen(t: Floats, is_outer: bool) -> Floats:
    """Light of a ring lamp on a rounded edge: it falls off as a Gaussian integral does, not as the model has it."""
    return nothing(t, is_outer) + np.where(t < 0.0, 0.3 * erfc(-t / 5.0), 0.0)


def contact_between(t: Floats, is_outer: bool) -> Floats:
    return nothing(t, is_outer) if is_outer else contact(t, is_outer)


def profiles(light: Callable[[Floats, bool], Floats], at_px: float, rng: np.random.Generator) -> list[EdgeProfile]:
    """Profiles whose zero lies `at_px` inside the edge, as if a step had been fitted there."""
    fine = np.arange(-40.0, 40.0, FINE_PX)
    away = np.arange(-15.0, 15.0, 0.2)
    found = []
    for side, is_outer in FLANKS:
        seen = gaussian_filter1d(light(fine, is_outer), BLUR_PX / FINE_PX)
        pixel = np.convolve(seen, np.full(101, 1.0 / 101.0), "same")
        level = np.interp(away - at_px, fine, pixel) + NOISE * rng.standard_normal(away.size)
        found.append(EdgeProfile(away, level, np.full(away.size, NOISE), side, is_outer))
    return found


@pytest.mark.parametrize(
    ("light", "name"),
    [
        (wall, "wall"),
        (line, "glare"),
        (polished_inside, "glare"),
        (sheen, "glare"),
        (shadow, "shadow"),
        (contact, "shadow"),
        (contact_between, "shadow"),
        (wall_and_line, "glare and wall"),
    ],
    ids=[
        "wall",
        "line",
        "line on inner flanks",
        "sheen",
        "shadow",
        "contact shadow",
        "contact shadow between fingers",
        "wall and line",
    ],
)
def test_the_edge_is_found_beside_what_displaces_a_step(light: Callable[[Floats, bool], Floats], name: str) -> None:
    rng = np.random.default_rng(21)
    seen = profiles(light, 0.3, rng)
    assert is_more_beside(seen, 0.001, family("linear"))
    fits = fit_scenes(seen, 0.005, [family("linear")])
    assert fits[0].scene.name == name
    # A line and a band up to the edge look nearly alike, so that the mean over all fits is compared.
    weight = probabilities(fits)
    at = np.array([fit.at_px for fit in fits])
    own = np.array([np.diag(fit.at_covariance) for fit in fits])
    mean = weight @ at
    u_px = np.sqrt(weight @ (own + (at - mean) ** 2))
    inner = ~np.array([profile.is_outer for profile in seen])
    assert np.all(np.abs(mean - 0.3)[inner] < 2.5 * u_px[inner])
    assert u_px.max() < 0.3


@pytest.mark.parametrize("seed", [31, 32, 33, 34])
def test_brush_marks_on_the_finger_are_no_wall_shadow_or_line(seed: int) -> None:
    """Marks along the finger stand still in its own frame, so that the mean profile of many rows contains them."""
    rng = np.random.default_rng(seed)

    def brushed(t: Floats, is_outer: bool) -> Floats:
        marks = gaussian_filter1d(rng.standard_normal(t.size), 0.9 / FINE_PX)
        return nothing(t, is_outer) + np.where(t < 0.0, 0.04 * marks / marks.std(), 0.0)

    fits = fit_scenes(profiles(brushed, 0.3, rng), 0.004, [family("linear")])
    mean = probabilities(fits) @ np.array([fit.at_px for fit in fits])
    assert np.abs(mean - 0.3).max() < 0.4


@pytest.mark.parametrize("width_px", [4.0, 9.0])
def test_light_that_is_spread_evenly_displaces_nothing(width_px: float) -> None:
    """Motion during the exposure, or a filter of the camera: half of the light on either side, on all flanks alike."""

    def spread(t: Floats, is_outer: bool) -> Floats:
        return DARK + (LIGHT - DARK) * np.clip(0.5 + t / width_px, 0.0, 1.0)

    seen = profiles(spread, 0.3, np.random.default_rng(23))
    fits = fit_scenes(seen, 0.004, [family("linear")])
    assert not fits[0].scene.name
    assert np.abs(fits[0].at_px - 0.3).max() < 0.1


def test_a_bare_edge_is_no_reason_to_look_for_more() -> None:
    rng = np.random.default_rng(22)
    seen = profiles(nothing, 0.3, rng)
    assert not is_more_beside(seen, 0.001, family("linear"))
    fits = fit_scenes(seen, 0.003, [family("linear")])
    assert not fits[0].scene.name
    assert fits[0].at_px == pytest.approx(0.3, abs=0.06)


@pytest.mark.parametrize("scene", [NOTHING, *SCENES, *PAIRS])
def test_steps_add_up_to_the_contrast(scene: Scene) -> None:
    rng = np.random.default_rng(23)
    sets = np.array(scene.mean) + np.array(scene.u) * rng.standard_normal((20, len(scene.mean)))
    side, is_outer = (np.array(each) for each in zip(*FLANKS, strict=True))
    distances, weights = scene.steps(sets, side, is_outer)
    assert distances.shape == weights.shape
    assert weights.sum(axis=-1) == pytest.approx(1.0)
