"""The frame: composition of the scene, light, noise, and the whole numbers of a sensor."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels
from fingervision.rendering.camera import Camera
from fingervision.rendering.coverage import coverage
from fingervision.rendering.outline import Outline
from fingervision.rendering.scene import Patch, Scene
from fingervision.rendering.union import union


def render(scene: Scene, camera: Camera, rng: np.random.Generator) -> Pixels:
    """Draw one frame.

    Parameters
    ----------
    scene : Scene
        What stands before the camera.
    camera : Camera
        How it is seen.
    rng : numpy.random.Generator
        Source of the noise; not touched where the camera has none.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height_px, width_px) or (height_px, width_px, 3)
        Grey levels, or red, green and blue.
    """
    return digitised(with_noise(exact_grey(scene, camera), camera, rng), camera)


def exact_grey(scene: Scene, camera: Camera) -> NDArray[np.float64]:
    """Grey levels before noise and rounding, shape (height_px, width_px); 255 is full scale, and not clipped."""
    light = scene.light
    grey: NDArray[np.float64] = np.full((scene.height_px, scene.width_px), light.ground)
    for patch in scene.behind:
        grey = _painted(grey, patch, light.ground, scene, camera)
    fingers = tuple(finger.outline for finger in scene.fingers)
    if fingers:
        covered = _covered(union(fingers), light.ground > light.fingers, scene, camera)
        if scene.rim is not None:
            grown = union(tuple(outline.grown(scene.rim.width_px) for outline in fingers))
            rimmed = _covered(grown, light.ground > scene.rim.level, scene, camera)
            grey = grey + (scene.rim.level - grey) * (rimmed - covered)
        grey = grey + (light.fingers - grey) * covered
    for patch in scene.before:
        grey = _painted(grey, patch, light.fingers, scene, camera)
    return grey * light.field(scene.width_px, scene.height_px, camera.blur_px)


def with_noise(grey: NDArray[np.float64], camera: Camera, rng: np.random.Generator) -> NDArray[np.float64]:
    """Add white noise, and shot noise where the camera has it."""
    if camera.shot_grey > 0.0:
        spread = np.sqrt(camera.noise_grey**2 + camera.shot_grey * np.maximum(grey, 0.0))
        return grey + spread * rng.standard_normal(grey.shape)
    if camera.noise_grey > 0.0:
        return grey + camera.noise_grey * rng.standard_normal(grey.shape)
    return grey


def digitised(grey: NDArray[np.float64], camera: Camera) -> Pixels:
    """Round to the sensor's whole numbers and clip at its full scale."""
    if camera.tint is not None:
        grey = grey[..., None] * np.array(camera.tint)
    if camera.bits == 8:
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.clip(np.rint(grey * 257.0), 0, 65535).astype(np.uint16)


def _covered(outlines: tuple[Outline, ...], dark: bool, scene: Scene, camera: Camera) -> NDArray[np.float64]:
    grown_px = -camera.bloom_px if dark else camera.bloom_px
    outlines = tuple(outline.grown(grown_px) for outline in outlines)
    return coverage(outlines, camera.blur_px, scene.width_px, scene.height_px)


def _painted(
    grey: NDArray[np.float64], patch: Patch, ground: float, scene: Scene, camera: Camera
) -> NDArray[np.float64]:
    covered = _covered(patch.outlines, ground > patch.level, scene, camera)
    return grey + (patch.level - grey) * covered
