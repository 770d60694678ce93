"""Gauges: how well, how sure, how fast, and whether they stay silent where there is nothing.

    python -m tests.benchmarks.gauges [--each 40] [--seed 1] [--only patches photographs drawings ... silence]

patches      rendered textures moved by tenths of a pixel: bias and SD of shift_x, SD over the bound from the gradient
             of the noiseless picture (both pictures have noise: sigma sqrt(2) (H^-1)^(1/2)), stated u over SD, share of
             the three numbers within 1.96 u
photographs  textures that scikit-image ships (gravel, grass, brick), moved by whole pixels and binned by 10, seen
             through optics of 0.7 and 0.4 px and without any (aliased), at as many places as `--each`: bias at shifts
             of 0.1 to 0.9 px, RMS of the error, median stated u, share within 1.96 u
drawings     the same of surfaces drawn with sharp edges (`drawn_surfaces`), a new one for each, also moved down
lines        angle: RMS over the Cramer-Rao bound of a step with known levels and blur, over stated u; within 1.96 u
circles      RMS of the centre at radius 20, noise 2, blur 0.9; bias of the diameter; share within 1.96 u
markers      RMS of the middle, over the stated u (the bound of a mark of known shape), share within 1.96 u
cost         milliseconds of one core a frame (640x480): 1, 2 and 3 edges, 20 patches of 31 px; least and median frame
silence      frames without the thing a gauge looks for, and the numbers that were given all the same
"""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import skimage.data
from scipy.ndimage import gaussian_filter

from fingervision.domain.frame import Frame
from fingervision.gauges.kinds import measured_together
from fingervision.gauges.picture import picture_of
from fingervision.gauges.reading import Reading
from fingervision.vision.pipeline import Settings
from tests.benchmarks.drawn_surfaces import SURFACES
from tests.benchmarks.frame import Namespace, benchmark
from tests.gauges.drawn import Texture, bar, checker, cross, disc, drawn, half_plane, seen
from tests.gauges.followed import followed, gauges_of, share_within

NOISE, ROUNDED = 2.0, 2.0**2 + 1.0 / 12.0
PATCH = 'kind = "patch"\nx_px = 55\ny_px = 55\nwidth_px = 31\nheight_px = 31\nreach_px = 8'
SHAPE = (110, 110)


def _numbers(reading: Reading) -> np.ndarray:
    return np.array([quantity.in_pixels()[:2] for quantity in reading.quantities])


def _bound(light: np.ndarray, x: int, y: int, half: int) -> float:
    """Of shift_x: from the gradient of the noiseless picture, with shift_y and rotation sought as well."""
    down, across = np.gradient(light)
    part = (slice(y - half, y + half + 1), slice(x - half, x + half + 1))
    yy, xx = np.mgrid[-half : half + 1, -half : half + 1]
    g = np.stack([across[part], down[part], xx * down[part] - yy * across[part]]).reshape(3, -1)
    return float(np.sqrt(2 * ROUNDED * np.linalg.inv(g @ g.T)[0, 0]))


def patches(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([51, seed])
    gauges = gauges_of(folder, PATCH)
    errors, ratios, u, all_errors, all_u, missing = [], [], [], [], [], 0
    for number in range(each):
        texture = Texture(rng, 60, 4.0, 1.4)
        still = texture.light(SHAPE, 55, 55, 0.0)
        bound = _bound(still, 55, 55, 15)
        x, y, turn = 55 + 0.1 * (number % 10), 55 + rng.uniform(-0.5, 0.5), rng.uniform(-0.03, 0.03)
        moved = texture.light(SHAPE, x, y, turn)
        for _ in range(8):
            _, (reading,) = followed(gauges, [seen(still, NOISE, rng), seen(moved, NOISE, rng)])
            if not reading.quantities:
                missing += 1
                continue
            value, stated = _numbers(reading).T
            error = value - np.array([x - 55, y - 55, 1e3 * turn])
            errors.append(error[0])
            ratios.append(error[0] / bound)
            u.append(stated[0])
            all_errors += list(error)
            all_u += list(stated)
    print(
        f"patches      n {len(errors)} (missing {missing})  bias {np.mean(errors):+.4f} px  SD {np.std(errors):.4f} px"
        f"  SD/bound {np.std(ratios):.2f}  u/SD {np.mean(u) / np.std(errors):.2f}"
        f"  within {share_within(all_errors, all_u):.3f}"
    )


def _shifted(words: str, wholes: Iterator[np.ndarray], each: int, noise: float, seed: int, folder: Path) -> None:
    """Move surfaces that continue beyond their border by tenths of a pixel, and print what patches say."""
    keys = 'kind="patch"\nx_px=24\ny_px=24\nreach_px=3\n'
    gauges = [gauges_of(folder, f"{keys}width_px={n}\nheight_px={n}") for n in (21, 31)]
    rng = np.random.default_rng([52, seed])
    errors, u = np.full((each, 9, 2), np.nan), np.full((each, 9, 2), np.nan)
    for place, whole in zip(range(each), wholes, strict=False):
        scene = 128 + (whole - whole.mean()) * 40 / whole.std()
        scene = np.roll(scene, rng.integers(0, min(scene.shape), 2), axis=(0, 1))
        scene = scene.T if place % 2 else scene

        def camera(x: int, y: int, scene: np.ndarray = scene) -> np.ndarray:
            part = np.roll(scene, (y, x), axis=(0, 1))[:490, 11:501]
            return seen(part.reshape(49, 10, 49, 10).mean(axis=(1, 3)), noise, rng)

        first = camera(0, 0)
        for shift in range(1, 10):
            down = int(rng.integers(-9, 10))
            reading = followed(gauges[place % 2], [first, camera(shift, down)])[1][0]
            if reading.quantities:
                value, stated = _numbers(reading)[:2].T
                errors[place, shift - 1], u[place, shift - 1] = value - (shift / 10, down / 10), stated
    there = np.isfinite(errors)
    if not there.any():
        print(f"{words}: n 0 of {9 * each}", flush=True)
        return
    biases = " ".join(f"{own[np.isfinite(own)].mean():+.4f}" for own in errors[:, :, 0].T if np.isfinite(own).any())
    print(
        f"{words}: n {there.sum() // 2} of {9 * each}  bias {biases} px, RMS {np.sqrt(np.nanmean(errors**2)):.4f}, u "
        f"{np.nanmedian(u):.4f}, within {share_within(errors[there], u[there]):.3f}",
        flush=True,
    )


def photographs(each: int, folder: Path, seed: int = 1) -> None:
    for blur in (0.7, 0.4, 0.0):
        for name in ("gravel", "grass", "brick"):
            # Mirrored, it continues beyond its border without a seam, which would be a sharp edge through optics too.
            tile = np.asarray(getattr(skimage.data, name)(), dtype=float)
            whole = gaussian_filter(np.pad(tile, ((0, 512), (0, 512)), mode="symmetric"), 10 * blur, mode="wrap")
            _shifted(f"photographs  {name}, blur {blur}", iter([whole] * each), each, 0.3, seed, folder)


def drawings(each: int, folder: Path, seed: int = 1) -> None:
    for blur, noise in ((0.7, 2.0), (0.4, 0.3), (0.0, 0.3)):
        for name, draw in SURFACES.items():
            rng = np.random.default_rng([seed, len(name)])
            wholes = (gaussian_filter(draw(rng), 10 * blur, mode="wrap") for _ in range(each))
            _shifted(f"drawings     {name}, blur {blur}, noise {noise}", wholes, each, noise, seed, folder)


def lines(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([53, seed])
    errors, u, length, blur = [], [], 60.0, 0.9
    for _ in range(each):
        angle, lean = rng.uniform(-180, 180), rng.uniform(-0.1, 0.1)
        light = drawn(SHAPE, 60, [(half_plane(55, 55, np.radians(angle) - np.pi / 2 + lean), 160)], blur)
        gauges = gauges_of(folder, f'kind="line"\nx_px=55\ny_px=55\nangle_deg={angle}\nlength_px={length}\n')
        for _ in range(10):
            ((reading,),) = followed(gauges, [seen(light, NOISE, rng)])
            value, stated = _numbers(reading)[1]
            errors.append(value - 1e3 * (np.radians(angle) + lean))
            u.append(stated)
    sigma = np.hypot(blur, 12**-0.5)
    bound = 1e3 * np.sqrt(ROUNDED / 100**2 * 12 / length**3 * 2 * np.sqrt(np.pi) * sigma)
    rms = np.sqrt(np.mean(np.square(errors)))
    print(
        f"lines        n {len(errors)}  angle RMS {rms:.3f} mrad  over bound, levels and blur known {rms / bound:.2f}  "
        f"over stated u {rms / np.mean(u):.2f}  within {share_within(errors, u):.3f}"
    )


def circles(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([54, seed])
    gauges = gauges_of(folder, 'kind = "circle"\nx_px = 55\ny_px = 55\ndiameter_px = 40\nreach_px = 10')
    errors, u = [], []
    for _ in range(each):
        x, y, r = 55 + rng.uniform(-4, 4), 55 + rng.uniform(-4, 4), 20 + rng.uniform(-0.5, 0.5)
        light = drawn(SHAPE, 60, [(disc(x, y, r), 160)], 0.9)
        for _ in range(10):
            ((reading,),) = followed(gauges, [seen(light, NOISE, rng)])
            value, stated = _numbers(reading).T
            errors.append(value - np.array([x, y, 2 * r]))
            u.append(stated)
    found = np.array(errors)
    print(
        f"circles      n {len(errors)}  centre RMS {np.sqrt(np.mean(found[:, :2] ** 2)):.4f} px  diameter bias "
        f"{found[:, 2].mean():+.4f} px, RMS {np.sqrt(np.mean(found[:, 2] ** 2)):.4f}  within "
        f"{share_within(found.ravel(), np.ravel(u)):.3f}"
    )


def markers(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([55, seed])
    for shape in ("dot", "cross", "corner"):
        keys = f'kind = "marker"\nx_px = 55\ny_px = 55\nsize_px = 25\nshape = "{shape}"\nreach_px = 8'
        gauges, errors, u = gauges_of(folder, keys), [], []
        for _ in range(max(each // 3, 4)):
            (x, y), turn = 55 + rng.uniform(-3, 3, 2), rng.uniform(-0.5, 0.5)
            thing = {"dot": disc(x, y, 6.3), "cross": cross(x, y, turn, 4, 9), "corner": checker(x, y, turn)}[shape]
            light = drawn(SHAPE, 60, [(thing, 160)])
            for _ in range(10):
                ((reading,),) = followed(gauges, [seen(light, NOISE, rng)])
                if reading.quantities:
                    value, stated = _numbers(reading).T
                    errors += list(value - np.array([x, y]))
                    u += list(stated)
        rms = np.sqrt(np.mean(np.square(errors)))
        share = share_within(errors, u)
        print(
            f"markers      {shape}: n {len(errors)}  RMS {rms:.4f} px  RMS/u {rms / np.mean(u):.2f}  within {share:.3f}"
        )


def cost(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([56, seed])
    texture = Texture(rng, 420, 4.5, 1.6)
    textured = [seen(texture.light((480, 640), 320 + 0.7 * k, 240 - 0.3 * k, 5e-4 * k), NOISE, rng) for k in range(6)]
    keys = 'kind="patch"\nwidth_px=31\nheight_px=31\n'
    twenty = [f"{keys}x_px={60 + 120 * i}\ny_px={60 + 120 * j}" for i in range(5) for j in range(4)]
    lights = [drawn((96, 128), 60, [(half_plane(64 + 0.7 * k, 48, 0.05), 160)]) for k in range(4)]
    plain = [np.tile(seen(light, NOISE, rng), (5, 5)) for light in lights]
    edge = 'kind="edge"\nx_px=64\ndirection_deg=0\nlength_px=40\n'
    cases = [("20 patches of 31 px", gauges_of(folder, *twenty), textured)]
    for count in (1, 2, 3):
        tables = [f"{edge}y_px={144 + 96 * i}" for i in range(count)]
        cases.append((f"{count} edge{'s' if count > 1 else ''} of 40 px", gauges_of(folder, *tables), plain))
    for words, gauges, frames in cases:
        followers, settings = [gauge.spec.follower() for gauge in gauges], Settings(10.0)
        pictures = [picture_of(Frame(frame, i), settings) for i, frame in enumerate(frames)]
        spent, numbers = [], 0
        for picture in (pictures + pictures[::-1]) * 10:
            begun = time.process_time()
            readings = measured_together(followers, picture)
            spent.append(1e3 * (time.process_time() - begun))
            numbers += sum(bool(reading.quantities) for reading in readings)
        spent = spent[len(pictures) :]
        least, median = min(spent), np.median(spent)
        print(f"cost         {words}: least {least:.2f} ms, median {median:.2f} ms a frame ({numbers} numbers)")


def _empty(rng: np.random.Generator, shape: tuple[int, int], has_texture: bool) -> Iterator[np.ndarray]:
    kinds: list[Callable[[], np.ndarray]] = [
        lambda: np.full(shape, rng.uniform(20, 230)),
        lambda: rng.normal(128, rng.uniform(5, 60), shape),
        lambda: 60 + np.add.outer(np.arange(shape[0]), np.arange(shape[1])) * rng.uniform(0, 0.8),
    ]
    if has_texture:
        kinds += [
            lambda: Texture(rng, 75, rng.uniform(3, 8), rng.uniform(1.2, 3)).light(shape, 55, 55, 0.0),
            lambda: np.kron(rng.uniform(30, 220, (22, 22)), np.ones((5, 5))),
        ]
    number = 0
    while True:
        yield seen(kinds[number % len(kinds)](), rng.uniform(1, 5), rng)
        number += 1


def silence(each: int, folder: Path, seed: int = 1) -> None:
    rng = np.random.default_rng([57, seed])
    texture = Texture(rng, 75)
    shown = texture.light(SHAPE, 55, 55, 0.0)
    things = {
        "edge": ("direction_deg = 0\nlength_px = 40", drawn(SHAPE, 60, [(half_plane(55, 55, 0.0), 160)])),
        "pair": (
            "direction_deg = 0\nlength_px = 30\ndistance_px = 20",
            drawn(SHAPE, 60, [(bar(55, 55, 0.0, 20), 160)]),
        ),
        "line": ("angle_deg = 30\nlength_px = 50", drawn(SHAPE, 60, [(half_plane(55, 55, -np.pi / 3), 160)])),
        "circle": ("diameter_px = 30", drawn(SHAPE, 60, [(disc(55, 55, 15), 160)])),
        "marker": ('size_px = 21\nshape = "cross"', drawn(SHAPE, 60, [(cross(55, 55, 0.1, 4, 8), 160)])),
        "patch": ("width_px = 31\nheight_px = 31", shown),
        "gap": (
            "width_px = 90\nheight_px = 90",
            drawn(SHAPE, 200, [(lambda x, y, at=at: np.minimum(9 - np.abs(x - at), y - 30), 50) for at in (36, 74)]),
        ),
    }
    for kind, (keys, light) in things.items():
        reach = "" if kind == "gap" else "reach_px = 8\n"
        gauges = gauges_of(folder, f'kind = "{kind}"\nx_px = 55\ny_px = 55\n{reach}{keys}')
        # A texture is what a patch measures: in a first frame any will do.
        before, after = _empty(rng, SHAPE, kind != "patch"), _empty(rng, SHAPE, True)
        fresh = sum(bool(followed(gauges, [next(before)])[0][0].quantities) for _ in range(each * 5))
        rows = followed(gauges, [seen(light, NOISE, rng), *(next(after) for _ in range(each * 20))])
        lost = sum(bool(row[0].quantities) for row in rows[1:])
        print(
            f"silence      {kind}: numbers in {each * 5} first frames without it {fresh}, in {each * 20} frames after"
            f" it went {lost} (seen at first: {bool(rows[0][0].quantities)})"
        )


PARTS = {f.__name__: f for f in (patches, photographs, drawings, lines, circles, markers, cost, silence)}


@benchmark(each=40, seed=1, only={"nargs": "+", "choices": sorted(PARTS), "default": list(PARTS)})
def main(arguments: Namespace) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.only:
            PARTS[name](arguments.each, Path(folder), arguments.seed)
