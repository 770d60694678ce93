"""What cannot be drawn is refused with the number that is wrong."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.rendering.camera import IDEAL_CAMERA, Camera, RadialLens, Tilt
from fingervision.rendering.finger import EllipticTip, SquareTip
from fingervision.rendering.outline import Line, Outline, disc
from fingervision.rendering.polygon import polygon
from fingervision.rendering.scene import Light, Rim, Scene, dust
from fingervision.rendering.targets import bar, chessboard, slot
from fingervision.rendering.truth import truth
from fingervision.rendering.two_fingers import two_fingers

UP, LEFT = two_fingers(20.0), two_fingers(20.0, direction=Direction.LEFT)
SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 50.0), (0.0, 50.0))


@pytest.mark.parametrize(
    ("draw", "number"),
    [
        (lambda: Camera(blur_px=0.0), "but is 0"),
        (lambda: Camera(blur_px=float("nan")), "but is nan"),
        (lambda: Camera(noise_grey=-1.0), "but is -1"),
        (lambda: Camera(bloom_px=float("inf")), "but is inf"),
        (lambda: Camera(bits=12), "but is 12"),
        (lambda: Camera(tint=(1.0, 2.0)), "(1.0, 2.0)"),
        (lambda: Scene(light=Light(ground=300.0)), "but is 300"),
        (lambda: Scene(width_px=0), "but is 0"),
        (lambda: Light(slope_x=2.5), "between -2 and 2"),
        (lambda: Rim(0.0, 250.0), "but is 0"),
        (lambda: dust(3, np.random.default_rng(0), size_px=(0.0, 2.0)), "positive"),
        (lambda: two_fingers(20.0, tip_step_px=30.0), "30 px"),
        (lambda: two_fingers(float("nan")), "finite"),
        (lambda: two_fingers(20.0, below_tip_px=-1.0), "but is -1"),
        (lambda: two_fingers(20.0, tilt_deg=90.0), "but is 90"),
        (lambda: two_fingers(20.0, tip=SquareTip(slant_deg=80.0)), "but is 80"),
        (lambda: two_fingers(20.0, width_px=0.0), "0 px"),
        (lambda: two_fingers(20.0, width_px=40.0, radius_px=21.0), "half the width"),
        (lambda: two_fingers(20.0, tip=EllipticTip(0.0)), "0 px"),
        (lambda: truth(replace(UP, fingers=(UP.fingers[0], LEFT.fingers[0])), IDEAL_CAMERA, 10.0), "up, left"),
        (lambda: RadialLens(k1=-0.5), "k1 = -0.5"),
        (lambda: Tilt(about_x_deg=60.0), "but is 60"),
        (lambda: Tilt(distance_px=-1.0), "but is -1"),
        (lambda: Outline((Line(0.0, 0.0, 1.0, 0.0),)), "1 px away"),
        (lambda: polygon(SQUARE, (-1.0, 0.0, 0.0, 0.0)), "but is -1 px"),
        (lambda: polygon(SQUARE, (6.0, 6.0, 0.0, 0.0)), "half the width"),
        (lambda: polygon(SQUARE[:2]), "but has 2"),
        (lambda: polygon(((0.0, 0.0), (0.0, 0.0), (1.0, 1.0))), "0 px"),
        (lambda: disc(0.0, 0.0, -2.0), "but is -2"),
        (lambda: bar(0.0, 100.0, x_px=0.0, y_px=0.0), "but is 0"),
        (lambda: chessboard((9, 6), -3.0, x_px=0.0, y_px=0.0), "but is -3"),
        (lambda: slot(100.0, 900.0, x_px=320.0, y_px=240.0), "690"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw: Callable[[], object], number: str) -> None:
    with pytest.raises(DataError) as refused:
        draw()
    assert number in str(refused.value)
