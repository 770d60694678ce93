"""Where there is no number there is a reason, and never a plausible wrong value."""

from collections.abc import Callable
from itertools import product

import cv2
import numpy as np
import pytest

from fingervision.domain.frame import Frame, Pixels
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.rendering import Camera, Light, Patch, Scene, dust, render, two_fingers
from fingervision.rendering.plane import Motion
from fingervision.rendering.polygon import polygon
from fingervision.vision.pipeline import Settings, measure_frame

SETTINGS = Settings(10.2)
CAMERA = Camera(blur_px=0.9, noise_grey=2.0)


def _one_finger(**options: object) -> Scene:
    both = two_fingers(150.0, radius_px=30.0, tip_at_px=120.4, **options)  # type: ignore[arg-type]
    return Scene(both.fingers[:1], behind=both.behind, light=both.light)


def _bar(x: float, y: float, width: float, height: float, level: float = 40.0) -> Patch:
    w, h = width / 2, height / 2
    return Patch((polygon(((-w, -h), (w, -h), (w, h), (-w, h)), (0.0,) * 4).moved(Motion(x_px=x, y_px=y)),), level)


def _drawn(scene: Scene, camera: Camera = CAMERA) -> Callable[[np.random.Generator], Pixels]:
    return lambda rng: render(scene, camera, rng)


def _noisy(level: float, spread: float) -> Callable[[np.random.Generator], Pixels]:
    return lambda rng: np.clip(rng.normal(level, spread, (480, 640)), 0, 255).astype(np.uint8)


def _uneven(rng: np.random.Generator) -> Pixels:
    y, x = np.mgrid[:480, :640]
    return np.clip(60 + 130 * x / 640 + 40 * y / 480 + rng.normal(0, 2, (480, 640)), 0, 255).astype(np.uint8)


def _vignette(rng: np.random.Generator) -> Pixels:
    y, x = np.mgrid[:480, :640]
    light = 210 * np.exp(-((x - 330) ** 2 + (y - 250) ** 2) / (2 * 200.0**2))
    return np.clip(light + rng.normal(0, 2, (480, 640)), 0, 255).astype(np.uint8)


def _chessboard(_rng: np.random.Generator) -> Pixels:
    y, x = np.mgrid[:480, :640]
    board = np.where((x // 40 + y // 40) % 2 == 0, 220, 30).astype(np.uint8)
    return cv2.GaussianBlur(board, (0, 0), 0.9)  # type: ignore[return-value]


def _checker(_rng: np.random.Generator) -> Pixels:
    y, x = np.mgrid[:480, :640]
    return np.where((x + y) % 2 == 0, 255, 0).astype(np.uint8)


def _fine_checker(_rng: np.random.Generator) -> Pixels:
    y, x = np.mgrid[:480, :640]
    return np.where((x // 7 + y // 7) % 2 == 0, 230, 20).astype(np.uint8)


def _text(rng: np.random.Generator) -> Pixels:
    page = np.full((480, 640), 220, dtype=np.uint8)
    for line in range(12):
        words = "".join(chr(c) for c in rng.integers(97, 123, 34))
        cv2.putText(page, words, (15, 40 + 36 * line), cv2.FONT_HERSHEY_SIMPLEX, 0.8, 30, 2, cv2.LINE_AA)
    return page


def _random_pixels(rng: np.random.Generator) -> Pixels:
    return rng.integers(0, 256, (480, 640), dtype=np.uint8)


def _blobs(rng: np.random.Generator) -> Pixels:
    smooth = cv2.GaussianBlur(rng.normal(0, 1, (480, 640)), (0, 0), 12)
    return np.where(smooth > 0, 220, 40).astype(np.uint8)


def _disc_and_bar(rng: np.random.Generator) -> Pixels:
    picture = render(_one_finger(behind=(_bar(560.0, 300.0, 40.0, 150.0),)), CAMERA, rng)
    cv2.circle(picture, (450, 220), 25, 40, -1, cv2.LINE_AA)
    return picture


# The reason that must be given; several where design.md's order leaves the scene to more than one.
SCENES: dict[str, tuple[Callable[[np.random.Generator], Pixels], set[Status]]] = {
    "black": (lambda _rng: np.zeros((480, 640), np.uint8), {Status.LOW_CONTRAST}),
    "black_16_bit": (lambda _rng: np.zeros((480, 640), np.uint16), {Status.LOW_CONTRAST}),
    "lens_cap": (_noisy(3.0, 1.5), {Status.LOW_CONTRAST}),
    "uniform_noise": (_noisy(128.0, 10.0), {Status.LOW_CONTRAST}),
    "white": (lambda _rng: np.full((480, 640), 255, np.uint8), {Status.SATURATED}),
    "white_16_bit": (lambda _rng: np.full((480, 640), 65535, np.uint16), {Status.SATURATED}),
    "saturated_flank": (
        _drawn(two_fingers(150.0, radius_px=30.0, light=Light(ground=250.0, fingers=120.0, exposure=6.0))),
        {Status.SATURATED, Status.LOW_CONTRAST},
    ),
    "one_finger": (_drawn(_one_finger()), {Status.ONE_FINGER}),
    "no_finger": (_drawn(Scene(())), {Status.LOW_CONTRAST}),
    "tips_beyond_the_border": (_drawn(two_fingers(150.0, tip_at_px=-30.0)), {Status.TIP_OUT_OF_VIEW}),
    "one_tip_beyond_the_border": (
        _drawn(two_fingers(150.0, radius_px=30.0, tip_at_px=40.0, tip_step_px=70.0)),
        {Status.TIP_OUT_OF_VIEW, Status.ONE_FINGER},
    ),
    "blur_7_px": (_drawn(two_fingers(150.0, radius_px=30.0), Camera(blur_px=7.0, noise_grey=2.0)), {Status.BLURRED}),
    "notch_above_the_measuring_height": (_drawn(two_fingers(-4.0, radius_px=30.0)), {Status.TOUCHING}),
    "uneven_light": (_uneven, {Status.LOW_CONTRAST, Status.NO_FINGERS, Status.ONE_FINGER, Status.BLURRED}),
    "vignette": (_vignette, {Status.LOW_CONTRAST, Status.NO_FINGERS, Status.ONE_FINGER, Status.BLURRED}),
}
# Anything but a number.
CLUTTER: dict[str, Callable[[np.random.Generator], Pixels]] = {
    "one_finger_a_disc_and_a_bar": _disc_and_bar,
    "dust_only": _drawn(Scene((), before=dust(40, np.random.default_rng(81)))),
    "text": _text,
    "chessboard": _chessboard,
    "checker_of_single_pixels": _checker,
    "checker_of_seven_pixels": _fine_checker,
    "random_pixels": _random_pixels,
    "blobs": _blobs,
    "one_pixel": lambda _rng: np.array([[7]], dtype=np.uint8),
    "sixteen_pixels": lambda rng: rng.integers(0, 256, (16, 16), dtype=np.uint8),
    "one_row": lambda rng: rng.integers(0, 256, (1, 640), dtype=np.uint8),
    "one_column": lambda rng: rng.integers(0, 256, (480, 1), dtype=np.uint8),
}


# Known defects, by seed, so that the day one is mended shows.
DEFECTS = {("blobs", 84): "two round blobs that come in from the border are taken for fingers"}


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_without_a_gap_says_why(name: str) -> None:
    draw, reasons = SCENES[name]
    found = measure_frame(Frame(draw(np.random.default_rng([82, len(name)])), 0), SETTINGS)
    assert isinstance(found, NoGap), found
    assert found.status in reasons, found
    assert found.words.endswith(".")


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        pytest.param(name, seed, marks=pytest.mark.xfail(reason=why, strict=True) if why else ())
        for name, seed in product(CLUTTER, (83, 84))
        for why in [DEFECTS.get((name, seed))]
    ],
)
def test_clutter_is_never_a_number(name: str, seed: int) -> None:
    found = measure_frame(Frame(CLUTTER[name](np.random.default_rng(seed)), 0), SETTINGS)
    assert isinstance(found, NoGap), found
