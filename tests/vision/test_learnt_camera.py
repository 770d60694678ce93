"""The camera that edges show after a codec: what JPEG and H.264 hide is in the uncertainty."""

from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from calib.camera_response import standard_response
from calib.edge_profile import EdgeProfile, binned_profile
from calib.edge_scene import NOTHING
from calib.scene_fit import fit_scenes
from calib.tone_curves import family, fixed_family
from fingervision.domain.camera import ASSUMED_CAMERA, ResponseEstimate, stated_camera
from fingervision.domain.frame import Coding
from fingervision.vision.learnt_camera import learnt_from_profiles
from fingervision.vision.learnt_scene import DISCREPANCY, FlankSight, beside_edges, less_sure
from fingervision.vision.response_shift import edge_shift_px, u_edge_px
from tests.calib.test_edge_scene import chamfer, nothing
from tests.calib.test_edge_scene import profiles as scene_profiles

Floats = NDArray[np.float64]
# Light of finger and ground, and the Gaussian sigma of a sharp edge (pixels).
INSIDE, OUTSIDE, SIGMA_PX = 0.07, 0.65, 0.8


def drawn_edge(
    name: str, side: float, pictures: int, sigma_px: float, rng: np.random.Generator
) -> tuple[list[Floats], list[NDArray[np.uint8]]]:
    """Distances from a slightly tilted edge that moves a little, and the stored levels, of each picture."""
    response = standard_response(name)
    y, x = np.mgrid[0:72, 0:64]
    tilt, at = rng.uniform(-0.04, 0.04), rng.uniform(28.0, 36.0)
    away, stored = [], []
    for _ in range(pictures):
        at += rng.uniform(-0.3, 0.3)
        distance = side * (x - at - tilt * (y - 36))
        light = INSIDE + (OUTSIDE - INSIDE) * ndtr(distance / np.hypot(sigma_px, 12.0**-0.5))
        light += np.sqrt(light / 8000.0) * rng.standard_normal(light.shape)
        away.append(distance)
        stored.append(np.rint(255.0 * np.interp(light, response.light, response.level)).astype(np.uint8))
    return away, stored


def profile_of(away: list[Floats], pictures: list[NDArray[np.uint8]], side: float) -> EdgeProfile:
    near = [np.abs(distance) < 9.0 for distance in away]
    frame = np.repeat(np.arange(len(away)), [np.count_nonzero(is_near) for is_near in near])
    distance = np.concatenate([one[is_near] for one, is_near in zip(away, near, strict=True)])
    level = np.concatenate([one[is_near] / 255.0 for one, is_near in zip(pictures, near, strict=True)])
    bins = binned_profile(distance, level, frame, 1.0 / 255.0, side)
    assert bins is not None
    return bins


def jpeg_profiles(name: str, seed: int, quality: int) -> list[EdgeProfile]:
    """Four edges in six pictures each, through the camera's curve, noise and JPEG."""
    rng, found = np.random.default_rng(seed), []
    for side in (1.0, -1.0, 1.0, -1.0):
        away, stored = drawn_edge(name, side, 6, SIGMA_PX, rng)
        coded = [cv2.imencode(".jpg", one, [cv2.IMWRITE_JPEG_QUALITY, quality])[1] for one in stored]
        found.append(profile_of(away, [cv2.imdecode(one, cv2.IMREAD_GRAYSCALE) for one in coded], side))
    return found


def h264_profiles(name: str, seed: int) -> list[EdgeProfile]:
    """Four edges in twelve pictures each, through the camera's curve, noise and H.264."""
    rng, found = np.random.default_rng(seed), []
    for side in (1.0, -1.0, 1.0, -1.0):
        away, stored = drawn_edge(name, side, 12, 1.2, rng)
        with BytesIO() as memory:
            with av.open(memory, "w", format="matroska") as container:
                stream = container.add_stream("libx264", rate=25, options={"crf": "20"})
                stream.width, stream.height, stream.pix_fmt = 64, 72, "yuvj420p"
                for one in stored:
                    picture = av.VideoFrame.from_ndarray(one, format="gray")
                    container.mux(stream.encode(picture.reformat(format="yuvj420p", src_color_range=2)))
                container.mux(stream.encode())
            memory.seek(0)
            with av.open(memory) as container:
                seen = [frame.to_ndarray()[:72] for frame in container.decode(video=0)]
        found.append(profile_of(away, seen, side))
    return found


def error_and_u_px(found: ResponseEstimate, name: str) -> tuple[float, float]:
    """Displacement of an edge by the error of the response, and its stated standard uncertainty."""
    true = standard_response(name)
    levels = np.interp((INSIDE, OUTSIDE), true.light, true.level)
    inside, outside = (float(v) for v in np.interp(levels, found.curve.level, found.curve.light))
    return edge_shift_px(found.curve, true, inside, outside, SIGMA_PX), u_edge_px(found, inside, outside, SIGMA_PX)


@pytest.mark.parametrize("name", ["srgb", "linear"])
def test_what_jpeg_hides_is_in_the_uncertainty(name: str) -> None:
    """JPEG removes the fine detail of sharp edges, in which tone curves differ, in every block alike."""
    for seed in (20, 21):
        camera = learnt_from_profiles(jpeg_profiles(name, seed, 85), ASSUMED_CAMERA, Coding.INTRAFRAME)
        error_px, u_px = error_and_u_px(camera.response, name)
        assert abs(error_px) < 2.0 * u_px + 1e-6
        assert u_px < 0.15


@pytest.mark.parametrize(
    ("name", "seeds"),
    [
        ("srgb", (30, 31)),
        ("linear", (30, 31)),
        *(pytest.param(name, range(30, 36), marks=pytest.mark.slow) for name in ("srgb", "linear")),
    ],
)
def test_what_h264_hides_is_in_the_uncertainty(name: str, seeds: Sequence[int]) -> None:
    """Each edge has errors of its own, and so much of a tone curve is left that a linear camera is not corrected."""
    error, u = np.transpose(
        [
            error_and_u_px(
                learnt_from_profiles(h264_profiles(name, seed), ASSUMED_CAMERA, Coding.INTERFRAME).response, name
            )
            for seed in seeds
        ]
    )
    assert np.all(np.abs(error) < 2.0 * u + 1e-6)
    if name == "srgb" and len(seeds) < 6:  # the bars are those of six recordings
        return
    # An edge of the linear camera is displaced by 0.52 px between the two, one of the other by 0.31 px.
    assert float(np.sqrt(np.mean(error**2))) < (0.01 if name == "linear" else 0.2)
    assert float(np.median(u)) < (0.32 if name == "linear" else 0.15)


def textured_profiles(seed: int, *, is_told: bool) -> list[EdgeProfile]:
    """Profiles of edges of a linear camera whose dark side has a pattern, which moves with it."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:64, 0:64].astype(float)
    found = []
    for side in (1.0, -1.0, 1.0, -1.0):
        pattern = cv2.GaussianBlur(rng.standard_normal((64, 64)), (0, 0), 1.5)
        pattern *= 0.08 * (OUTSIDE - INSIDE) / pattern.std()
        away, level, rows, frames = [], [], [], []
        tilt, at = rng.uniform(-0.04, 0.04), rng.uniform(28.0, 36.0)
        for frame in range(6):
            way = rng.uniform(-0.5, 0.5)
            distance = side * (x - at - way - tilt * (y - 32))
            share = ndtr(distance / np.hypot(SIGMA_PX, 12.0**-0.5))
            moved = cv2.warpAffine(pattern, np.float32([[1, 0, way], [0, 1, 0]]), (64, 64), flags=cv2.INTER_CUBIC)
            light = (INSIDE + moved) * (1.0 - share) + OUTSIDE * share
            light += np.sqrt(np.maximum(light, 0.0) / 8000.0) * rng.standard_normal(light.shape)
            near = np.abs(distance) < 9.0
            away.append(distance[near])
            level.append(np.rint(255.0 * np.clip(light, 0.0, 1.0))[near] / 255.0)
            rows.append(y[near].astype(int))
            frames.append(np.full(away[-1].size, frame))
        part = np.concatenate(rows) // 8 if is_told else None
        bins = binned_profile(
            np.concatenate(away), np.concatenate(level), np.concatenate(frames), 1.0 / 255.0, side, part=part
        )
        assert bins is not None
        found.append(bins)
    return found


def test_texture_of_the_fingers_is_in_the_uncertainty() -> None:
    """A pattern is the same in all pictures, and does not average out over them."""
    silent = {True: 0, False: 0}
    for seed in (40, 47):
        for is_told in silent:
            profiles = textured_profiles(seed, is_told=is_told)
            camera = learnt_from_profiles(profiles, ASSUMED_CAMERA, Coding.LOSSLESS)
            error_px, u_px = error_and_u_px(camera.response, "linear")
            silent[is_told] += abs(error_px) > max(2.0 * u_px, 0.05)
    assert silent[False] > 0, "nothing would be shown by these patterns"
    assert silent[True] == 0


def test_a_drawing_without_noise_has_no_structure() -> None:
    """Rows that are all the same, as of a drawing: their parts differ by nothing, and the noise is that of rounding."""
    y, x = np.mgrid[0:64, 0:40].astype(float)
    away = x - 20.3
    shifted = [np.round(away + 0.2 * k, 6) for k in range(5)]
    frames = np.repeat(np.arange(5), away.size)
    part = np.tile(y.ravel().astype(int) // 8, 5)
    distance = np.concatenate([one.ravel() for one in shifted])
    stored = np.rint(255.0 * (INSIDE + (OUTSIDE - INSIDE) * ndtr(distance / SIGMA_PX))) / 255.0
    bins = binned_profile(distance, stored, frames, 1.0 / 255.0, 1.0, part=part)
    assert bins is not None
    assert not bins.u_structure.any()
    assert bins.u_level.min() > 0.0


def test_a_chamfer_that_a_tone_curve_imitates_is_in_the_uncertainty() -> None:
    """An even bright band up to the edge has nearly the profile of a plain edge behind a film's shoulder."""
    wide = scene_profiles(chamfer, 0.3, np.random.default_rng(61))
    narrow = [
        replace(each, away_px=each.away_px[near], level=each.level[near], u_level=each.u_level[near])
        for each in wide
        for near in (np.abs(each.away_px) < 8.0,)
    ]
    camera = learnt_from_profiles(
        narrow, ASSUMED_CAMERA, Coding.LOSSLESS, FlankSight(wide, Coding.LOSSLESS, DISCREPANCY)
    )
    assert camera.beside is not None
    fits = fit_scenes(wide, DISCREPANCY, [fixed_family(camera.response.curve)])
    beside = less_sure(beside_edges(fits, wide), camera.beside.u_gap_px)
    assert beside is not None
    plain = next(fit for fit in fits if fit.scene is NOTHING)
    inner = ~np.array([each.is_outer for each in wide])
    found = sum(beside.inner_px) if beside.name else float(plain.at_px[inner].sum())
    assert abs(found - 0.6) < 2.0 * beside.u_gap_px


def test_other_tone_curves_are_no_rivals_of_a_stated_one() -> None:
    """A plain edge behind a film's shoulder, which a linear camera would show with a chamfer."""
    shoulder = family("shoulder")
    response = shoulder.response(np.array(shoulder.mean))
    wide = [
        replace(each, level=np.interp(each.level, response.light, response.level))
        for each in scene_profiles(nothing, 0.3, np.random.default_rng(64))
    ]
    narrow = [
        replace(each, away_px=each.away_px[near], level=each.level[near], u_level=each.u_level[near])
        for each in wide
        for near in (np.abs(each.away_px) < 8.0,)
    ]
    assert (
        learnt_from_profiles(
            narrow,
            stated_camera(response),
            Coding.LOSSLESS,
            FlankSight(wide, Coding.LOSSLESS, DISCREPANCY),
        ).beside
        is None
    )
