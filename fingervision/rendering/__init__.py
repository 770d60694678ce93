"""Render scenes as frames with known true geometry: the outline before blurring, accurate to 0.001 px.

The names that this module exports suffice for most purposes; the README.md of this package explains how scenes are
rendered and why the result is exact. Calibration objects (`targets`) are imported separately.
"""

from fingervision.rendering.camera import IDEAL_CAMERA, Camera, RadialLens, Tilt
from fingervision.rendering.finger import EllipticTip, Finger, Highlight, SquareTip
from fingervision.rendering.picture import exact_grey, render
from fingervision.rendering.scene import EVEN_LIGHT, Light, LightStep, Patch, Rim, Scene, dust
from fingervision.rendering.truth import TrueEdge, TrueGap, truth
from fingervision.rendering.two_fingers import two_fingers

__all__ = [
    "EVEN_LIGHT",
    "IDEAL_CAMERA",
    "Camera",
    "EllipticTip",
    "Finger",
    "Highlight",
    "Light",
    "LightStep",
    "Patch",
    "RadialLens",
    "Rim",
    "Scene",
    "SquareTip",
    "Tilt",
    "TrueEdge",
    "TrueGap",
    "dust",
    "exact_grey",
    "render",
    "truth",
    "two_fingers",
]
