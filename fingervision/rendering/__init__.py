"""Scenes drawn as frames with a truth that is known: the outline before blur, good to 0.001 px.

The names below are all that others need; README.md says how the drawing is done and why it is exact.
"""

from fingervision.rendering.camera import IDEAL_CAMERA, Camera
from fingervision.rendering.finger import EllipticTip, Finger, SquareTip
from fingervision.rendering.light import Light, LightStep
from fingervision.rendering.picture import exact_grey, render
from fingervision.rendering.scene import Patch, Rim, Scene
from fingervision.rendering.truth import TrueEdge, TrueGap, truth
from fingervision.rendering.two_fingers import two_fingers

__all__ = [
    "IDEAL_CAMERA",
    "Camera",
    "EllipticTip",
    "Finger",
    "Light",
    "LightStep",
    "Patch",
    "Rim",
    "Scene",
    "SquareTip",
    "TrueEdge",
    "TrueGap",
    "exact_grey",
    "render",
    "truth",
    "two_fingers",
]
