"""Families of tone curves against profiles of edges that are blurred here, by sums over samples."""

import numpy as np
import pytest
from numpy.typing import NDArray

from calib.edge_profile import EdgeProfile
from calib.edge_response import fit_families, probabilities

Floats = NDArray[np.float64]
SIGMA_PX, NOISE = 1.1, 3e-4


def srgb_level(light: Floats) -> Floats:
    return np.where(light < 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1.0 / 2.4) - 0.055)


def profile(
    curve, side: float, rng: np.random.Generator, skew: float = 0.0, at_px: float = 0.05, disc_px: float = 0.0
) -> EdgeProfile:
    """An edge whose point spread is a Gaussian, with a one-sided part of this share towards larger coordinates.

    With `disc_px`, the Gaussian is convolved with a disc of this radius.
    """
    x = np.arange(-40.0, 40.0, 0.05)
    spread = np.exp(-0.5 * (x / SIGMA_PX) ** 2)
    spread += skew * np.exp(-0.5 * ((x - side * 1.2) / SIGMA_PX) ** 2)
    if disc_px:
        spread = np.convolve(spread, np.sqrt(np.maximum(disc_px**2 - x**2, 0.0)), "same")
    spread = np.convolve(spread, np.ones(20) / 20, "same")  # the pixel
    away = np.arange(-8.0, 8.0, 0.2)
    cumulative = np.cumsum(spread) / spread.sum()
    light = 0.06 + 0.6 * np.interp(away - at_px, x + 0.025, cumulative)
    level = curve(light) + NOISE * rng.standard_normal(away.size)
    return EdgeProfile(away, level, np.full(away.size, NOISE), side)


@pytest.mark.parametrize("skew", [0.0, 0.15])
@pytest.mark.parametrize(("name", "curve"), [("linear", lambda light: light), ("srgb", srgb_level)])
def test_the_true_curve_is_the_most_probable(name: str, curve, skew: float) -> None:
    rng = np.random.default_rng(3)
    fits = fit_families([profile(curve, side, rng, skew) for side in (1.0, -1.0)], 1e-3)
    chance = dict(zip((fit.family.name for fit in fits), probabilities(fits), strict=True))
    assert sum(chance.values()) == pytest.approx(1.0)
    if name == "linear":
        assert chance["linear"] > 0.9
    else:  # sRGB and BT.709 differ near black only
        assert chance["srgb"] + chance["bt709"] > 0.6
        assert chance["linear"] < 1e-3
    sigma, disc = np.exp(fits[0].shared[:2])
    assert sigma * np.hypot(1.0, 0.5 * disc) == pytest.approx(SIGMA_PX, rel=0.1 + skew)


@pytest.mark.parametrize(("name", "curve"), [("linear", lambda light: light), ("srgb", srgb_level)])
def test_defocus_is_told_from_a_tone_curve(name: str, curve) -> None:
    rng = np.random.default_rng(6)
    fits = fit_families([profile(curve, side, rng, disc_px=2.5) for side in (1.0, -1.0)], 1e-3)
    chance = dict(zip((fit.family.name for fit in fits), probabilities(fits), strict=True))
    assert chance[name] + (chance["bt709"] if name == "srgb" else 0.0) > 0.6
    own = next(fit for fit in fits if fit.family.name == name)
    assert np.exp(own.shared[:2].sum()) == pytest.approx(2.5, rel=0.1)


def test_a_tail_has_its_side_in_the_picture() -> None:
    rng = np.random.default_rng(7)
    fits = fit_families([profile(lambda light: light, side, rng, skew=0.15) for side in (1.0, -1.0)], 1e-3)
    larger, smaller = fits[0].shared[2:4]
    assert larger > smaller + 0.05


def test_a_profile_that_no_blur_explains_fits_badly() -> None:
    rng = np.random.default_rng(4)
    sound = profile(lambda light: light, 1.0, rng)
    hump = sound.level + 0.05 * np.exp(-0.5 * ((sound.away_px - 3.0) / 0.5) ** 2)
    fits = fit_families([EdgeProfile(sound.away_px, hump, sound.u_level, 1.0)], 1e-3)
    assert np.sqrt(fits[0].misfit[0]) > 2.0
    assert EdgeProfile(sound.away_px, hump, sound.u_level, 1.0).overshoot > 0.05
    assert sound.overshoot == 0.0


def test_one_sigma_curves_lie_beside_the_curve() -> None:
    rng = np.random.default_rng(5)
    fits = fit_families([profile(lambda light: light ** (1.0 / 1.8), side, rng) for side in (1.0, -1.0)], 1e-3)
    power = next(fit for fit in fits if fit.family.name == "power")
    assert np.exp(power.parameters[0]) == pytest.approx(1.8, abs=4.0 * 1.8 * np.sqrt(power.covariance[0, 0]) + 0.02)
    (other,) = power.one_sigma()
    assert not np.allclose(other.light, power.response().light)
