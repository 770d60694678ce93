"""Scenes drawn as frames with a truth that is known: the outline before blur, good to 0.001 px.

The names below are what most need; README.md says how the drawing is done and why it is exact. Compression lies beside
them (`jpeg`, `clip`), because it needs OpenCV and PyAV, as do objects to calibrate with (`targets`).
"""

from fingervision.rendering.camera import IDEAL_CAMERA, Camera
from fingervision.rendering.dust import dust
from fingervision.rendering.finger import EllipticTip, Finger, Highlight, SquareTip
from fingervision.rendering.lens import RadialLens, Tilt
from fingervision.rendering.light import EVEN_LIGHT, Light, LightStep
from fingervision.rendering.picture import exact_grey, render
from fingervision.rendering.scene import Patch, Rim, Scene
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
