"""Rendering of a frame: scene, light, noise, and rounding to integer levels."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels
from fingervision.rendering.camera import Camera
from fingervision.rendering.coverage import coverage, window_of
from fingervision.rendering.outline import Outline
from fingervision.rendering.polygon import union
from fingervision.rendering.scene import Scene


def render(scene: Scene, camera: Camera, rng: np.random.Generator) -> Pixels:
    """Render one frame.

    Parameters
    ----------
    scene : Scene
        Scene in front of the camera.
    camera : Camera
        Camera model.
    rng : numpy.random.Generator
        Generator of the noise; not used for a camera without noise.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height_px, width_px) or (height_px, width_px, 3)
        Grey levels, or red, green and blue.
    """
    return digitised(with_noise(exact_grey(scene, camera), camera, rng), camera)


def exact_grey(scene: Scene, camera: Camera) -> NDArray[np.float64]:
    """Grey levels before noise and rounding, shape (height_px, width_px); full scale is 255, values are not clipped."""
    light = scene.light
    grey: NDArray[np.float64] = np.full((scene.height_px, scene.width_px), light.ground, dtype=np.float64)
    for patch in scene.behind:
        _paint(grey, patch.outlines, patch.level, light.ground, camera)
    outlines = tuple(finger.outline for finger in scene.fingers)
    if outlines and scene.rim is None:
        _paint(grey, union(outlines), light.fingers, light.ground, camera)
    elif outlines and scene.rim is not None:
        rimmed = union(tuple(outline.grown(scene.rim.width_px) for outline in outlines))
        _paint(grey, rimmed, scene.rim.level, light.ground, camera)
        # The rim's outline includes the fingers. Where both edges are blurred, the result is exact only if the fingers
        # add the difference between their level and the rim's level.
        part, covered = _covered(grey, union(outlines), light.fingers < scene.rim.level, camera)
        part += (light.fingers - scene.rim.level) * covered
    for patch in scene.before:
        _paint(grey, patch.outlines, patch.level, light.fingers, camera)
    grey *= light.field(scene.width_px, scene.height_px, camera.blur_px)
    return grey


def with_noise(grey: NDArray[np.float64], camera: Camera, rng: np.random.Generator) -> NDArray[np.float64]:
    """Add white noise, and shot noise if the camera has it."""
    if camera.shot_grey > 0.0:
        spread = np.sqrt(camera.noise_grey**2 + camera.shot_grey * np.maximum(grey, 0.0))
        return grey + spread * rng.standard_normal(grey.shape)
    if camera.noise_grey > 0.0:
        noise = rng.standard_normal(grey.shape)
        noise *= camera.noise_grey
        noise += grey
        return noise
    return grey


def digitised(grey: NDArray[np.float64], camera: Camera) -> Pixels:
    """Round to integers, and clip at the sensor's full scale."""
    if camera.tint is not None:
        grey = grey[..., None] * np.array(camera.tint)
    if camera.bits == 8:
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.clip(np.rint(grey * 257.0), 0, 65535).astype(np.uint16)


def _paint(
    grey: NDArray[np.float64], outlines: tuple[Outline, ...], level: float, around: float, camera: Camera
) -> None:
    """Paint solids of one level; `around` is the level of their surroundings, which decides the edge bias."""
    part, covered = _covered(grey, outlines, level < around, camera)
    # part = level + (part - level) (1 - covered), computed in place, because new arrays of a frame's size take longer
    # than the arithmetic.
    np.subtract(1.0, covered, out=covered)
    part -= level
    part *= covered
    part += level


def _covered(
    grey: NDArray[np.float64], outlines: tuple[Outline, ...], dark: bool, camera: Camera
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the part of the picture that solids can change, as a view, and their coverage of its pixels."""
    height_px, width_px = grey.shape
    spread_px = -camera.bloom_px if dark else camera.bloom_px
    grown = [outline.grown(spread_px) for outline in camera.sees(outlines, width_px, height_px)]
    window = window_of(grown, camera.blur_px, width_px, height_px)
    part = grey[window.y_px : window.y_px + window.height_px, window.x_px : window.x_px + window.width_px]
    return part, coverage(grown, camera.blur_px, window)
