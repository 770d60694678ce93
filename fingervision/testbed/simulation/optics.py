"""Camera effects in the picture itself: lens, tilt, and a delay of the exposure."""

from dataclasses import dataclass, replace
from math import asin, degrees

from fingervision.effects import catalogue
from fingervision.rendering import Camera, RadialLens, Tilt
from fingervision.testbed.simulation.injected_effects import Hidden

# Sine of the tilt for a keystone effect as in the catalogue: the camera is then so near that the required tilt hardly
# shortens the plane.
TILT_SINE = 0.01


@dataclass(frozen=True, slots=True)
class Optics:
    """Optical settings with which a frame is rendered.

    Parameters
    ----------
    camera : Camera
        Tilt, lens, blur, noise.
    px_per_mm : float
        Scale at the centre of the picture.
    half_diagonal_mm : float
        Half diagonal of the frame.
    late_s : float
        Delay: a frame shows the scene this long before its time stamp.
    """

    camera: Camera
    px_per_mm: float
    half_diagonal_mm: float
    late_s: float = 0.0


def _lens(optics: Optics, k_per_mm2: float) -> Optics:
    """Convert the distortion x (1 + k x^2) in mm to the renderer's coordinate q = r / (half the diagonal)."""
    lens = RadialLens(k1=k_per_mm2 * optics.half_diagonal_mm**2)
    return replace(optics, camera=replace(optics.camera, lens=lens))


def _tilt(optics: Optics, k_per_mm: float) -> Optics:
    """Convert the keystone distortion x / (1 + k x) in mm to a tilted plane: k = sin(tilt) / distance."""
    sine = TILT_SINE if k_per_mm > 0.0 else -TILT_SINE
    tilt = Tilt(about_y_deg=degrees(asin(sine)), distance_px=sine / k_per_mm * optics.px_per_mm)
    return replace(optics, camera=replace(optics.camera, tilt=tilt))


def in_the_picture(name: str) -> bool:
    """Whether a camera effect is applied to the rendered picture itself.

    All other camera effects are applied by moving the scene in front of the camera, which is equivalent for drifts and
    scale errors. An edge bias in the picture would change the gap of round tips by less than the gap of straight edges,
    because the tips move down as well. The effect `edge_bias` of the catalogue does not depend on the tips, and is
    therefore also applied by moving the fingers.
    """
    return catalogue()[name].in_picture is not None


def hidden_in(optics: Optics, hidden: Hidden) -> Optics:
    """Add the injected effects of the camera to the optical settings."""
    for name, values in hidden.of_stage("camera").items():
        form_of = catalogue()[name].in_picture
        if form_of is None:
            continue
        form = form_of(values)
        optics = replace(optics, late_s=optics.late_s + form.late_s)
        if form.radial_per_mm2 != 0.0:
            optics = _lens(optics, form.radial_per_mm2)
        if form.keystone_per_mm != 0.0:
            optics = _tilt(optics, form.keystone_per_mm)
    return optics
