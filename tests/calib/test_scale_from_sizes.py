"""Scale and edge bias from rendered references: true values, polarity, and coverage of the intervals."""

import numpy as np
import pytest

from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits, rectangular
from calib.measured_scale import Reference
from calib.scale_from_sizes import MeasuredSize, ScaleFit, scale_from_sizes
from fingervision.rendering.camera import Camera, RadialLens
from fingervision.rendering.picture import render
from fingervision.rendering.scene import Light, Patch, Scene
from fingervision.rendering.targets import bar, slot

TRUE_SCALE, FRAME = 34.0, (640, 480)
# The bars of the issue: scale within 0.01 %, bias within 0.01 px, for a blooming of 0.3 px an edge.
SCALE_PART, BIAS_PX = 1e-4, 0.01


def seen(kind: str, size_mm: float, seed: int, u_size_mm: float = 0.001, **camera: object) -> KnownSize:
    rng = np.random.default_rng(seed)
    place = {"x_px": 319.5 + rng.uniform(-3, 3), "y_px": 239.5, "turn_deg": rng.uniform(-1, 1)}
    target = (bar if kind == "bar" else slot)(size_mm * TRUE_SCALE, 640.0 if kind == "bar" else 400.0, **place)
    scene = Scene(light=Light(ground=200.0), behind=(Patch(target, 40.0),))
    return KnownSize(f"{kind}{size_mm:g}.png", kind, size_mm, u_size_mm, render(scene, Camera(**camera), rng))


def fitted(*pictures: KnownSize, limits: Limits | None = None) -> ScaleFit:
    sizes = [
        MeasuredSize(
            Reference(each.name, each.size_mm, each.u_size_mm),
            edge.width_px,
            edge.u_width_px,
            edge.points_px,
            edge.light,
        )
        for each, edge in zip(pictures, find_widths(pictures), strict=True)
    ]
    return scale_from_sizes(sizes, FRAME, limits or Limits())


def simulated(
    scale: float, bias_px: float, sizes: tuple[tuple[float, bool], ...], u_px: float = 0.01
) -> list[MeasuredSize]:
    found = []
    for size_mm, light in sizes:
        width_px = scale * size_mm - (1.0 if light else -1.0) * bias_px
        points = np.array([[319.5 - width_px / 2, 239.5], [319.5 + width_px / 2, 239.5]])
        found.append(MeasuredSize(Reference("", size_mm, 0.001), width_px, u_px, points, light))
    return found


@pytest.mark.parametrize(
    "sizes", [(("bar", 2.0), ("bar", 8.0), ("bar", 14.0)), (("bar", 4.0), ("slot", 3.0), ("bar", 12.0))]
)
def test_blooming_is_told_from_the_scale(sizes: tuple[tuple[str, float], ...]) -> None:
    fit = fitted(*(seen(kind, size, seed, bloom_px=0.3, noise_grey=2.0) for seed, (kind, size) in enumerate(sizes)))
    assert fit.bias_known
    assert fit.calibration.px_per_mm == pytest.approx(TRUE_SCALE, rel=SCALE_PART)
    # Light that spreads by 0.3 px over each edge widens a light gap by 0.6 px: b = -0.6.
    assert fit.calibration.edge_bias_px == pytest.approx(-0.6, abs=BIAS_PX)


def test_one_dark_bar_keeps_the_bias_as_an_uncertainty() -> None:
    fit = fitted(seen("bar", 5.0, 1, bloom_px=0.3, noise_grey=2.0))
    calibration = fit.calibration
    assert not fit.bias_known
    assert calibration.edge_bias_px == 0.0
    assert calibration.u_edge_bias_px == pytest.approx(rectangular(Limits().edge_bias_px))
    assert abs(calibration.px_per_mm - TRUE_SCALE) < 2.0 * calibration.u_px_per_mm
    # A gap of 1 mm is seen 0.6 px too wide, on a scale that is too small: the errors add, and the interval holds them.
    gap_px = TRUE_SCALE + 0.6
    points = np.array([[[300.0, 240.0], [300.0 + gap_px, 240.0]]])
    got = calibration.distances(points, np.array([0.01]), np.array([True]))
    assert got.u_mm is not None
    assert got.value_mm[0] > 1.0 + 0.6 / TRUE_SCALE
    assert abs(got.value_mm[0] - 1.0) < 2.0 * got.u_mm[0]


def test_a_single_dark_pin_doubles_the_bias_of_a_light_gap() -> None:
    """measuring.md, section 4: for a gap as large as a reference pin, the uncertainty of the bias counts twice; with a
    slot as reference it cancels.
    """
    points = np.array([[[300.0, 240.0], [300.0 + 5 * TRUE_SCALE, 240.0]]])
    u_mm = {}
    for light in (False, True):
        calibration = scale_from_sizes(simulated(TRUE_SCALE, 0.0, ((5.0, light),)), FRAME, Limits()).calibration
        lines = calibration.budget(points, np.array([0.0]), np.array([True])).lines
        u_mm[light] = next(float(line.u_mm[0]) for line in lines if line.source == "edge bias")
    assert u_mm[False] == pytest.approx(2.0 * rectangular(0.6) / TRUE_SCALE, rel=1e-6)
    assert u_mm[True] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("light", [True, False])
def test_the_bias_changes_sign_with_polarity(light: bool) -> None:
    calibration = scale_from_sizes(
        simulated(TRUE_SCALE, -0.6, ((2.0, False), (8.0, False), (3.0, True))), FRAME, Limits()
    ).calibration
    gap_px = 2 * TRUE_SCALE + (0.6 if light else -0.6)
    points = np.array([[[300.0, 240.0], [300.0 + gap_px, 240.0]]])
    got = calibration.distances(points, np.array([0.01]), np.array([light]))
    assert got.value_mm[0] == pytest.approx(2.0, abs=1e-9)
    positions = calibration.positions_mm(points, 0, np.array([light]), FRAME)
    assert positions[0, 1] - positions[0, 0] == pytest.approx(2.0, abs=1e-9)
    assert positions[0].mean() == pytest.approx((300.0 + gap_px / 2 - 319.5) / TRUE_SCALE, abs=1e-9)


def test_a_lens_within_its_limit_is_no_misfit_and_one_beyond_is() -> None:
    sizes = (2.0, 5.0, 8.0, 11.0, 14.0, 17.0)
    for k1, sound in ((0.0008, True), (0.03, False)):
        fit = fitted(
            *(seen("bar", size, seed, lens=RadialLens(k1=k1), noise_grey=1.0) for seed, size in enumerate(sizes))
        )
        assert (fit.probability > 0.01) is sound
        assert any(part.source.startswith("misfit") for part in fit.calibration.parts) is not sound


def test_random_and_shared_parts_stay_apart() -> None:
    calibration = scale_from_sizes(simulated(TRUE_SCALE, 0.0, ((5.0, False),)), FRAME, Limits()).calibration
    points = np.repeat(np.array([[[300.0, 240.0], [340.0, 240.0]]]), 3, axis=0)
    quiet = calibration.distances(points, np.array([0.0, 0.01, 0.5]), np.array([True] * 3))
    assert quiet.u_mm is not None
    assert quiet.u_random_mm == pytest.approx(np.array([0.0, 0.01, 0.5]) / calibration.px_per_mm)
    shared = quiet.u_mm**2 - quiet.u_random_mm**2
    assert shared == pytest.approx(shared[:1].repeat(3))


def test_the_budget_is_that_of_the_table() -> None:
    """Table of measuring.md, section 4, for a gap of 1 mm; the Monte Carlo values in this table have two digits."""
    calibration = scale_from_sizes(
        simulated(TRUE_SCALE, 0.0, ((2.0, False), (5.0, False), (8.0, False))), FRAME, Limits()
    ).calibration
    points = np.array([[[319.5 - 17.0, 239.5], [319.5 + 17.0, 239.5]]])
    lines = {
        line.source: 1e3 * float(line.u_mm[0])
        for line in calibration.budget(points, np.array([0.015]), np.array([True])).lines
    }
    assert lines["edge noise"] == pytest.approx(0.44, abs=0.005)
    assert lines["estimator"] == pytest.approx(0.48, abs=0.005)
    assert lines["distance from the calibrated plane"] == pytest.approx(2.89, abs=0.005)
    assert lines["tilt: foreshortening"] == pytest.approx(0.35, abs=0.005)


def test_several_objects_are_named() -> None:
    targets = bar(60.0, 300.0, x_px=150.0, y_px=240.0) + bar(90.0, 300.0, x_px=420.0, y_px=240.0)
    grey = render(
        Scene(light=Light(200.0), behind=(Patch(targets, 40.0),)), Camera(noise_grey=1.0), np.random.default_rng(1)
    )
    with pytest.raises(
        ValueError, match=r"there are 2 candidates in the picture \(.*60\.0 px dark.*\): choose one of them by --roi"
    ):
        find_widths([KnownSize("two.png", "bar", 2.0, 0.001, grey)])
    (chosen,) = find_widths([KnownSize("two.png", "bar", 2.0, 0.001, grey)], region=(330, 40, 200, 400))
    assert chosen.width_px == pytest.approx(90.0, abs=0.02)


def test_the_shared_scale_says_which_side_of_a_rectangle_was_certified() -> None:
    pictures = []
    for seed, size_mm in enumerate((3.0, 8.0, 16.0)):
        scene = Scene(
            light=Light(200.0), behind=(Patch(bar(size_mm * TRUE_SCALE, 260.0, x_px=320.3, y_px=240.0), 40.0),)
        )
        grey = render(scene, Camera(noise_grey=1.0), np.random.default_rng(seed))
        pictures.append(KnownSize(f"{size_mm:g}", "bar", size_mm, 0.001, grey))
    widths = [edge.width_px for edge in find_widths(pictures)]
    assert widths == pytest.approx([102.0, 272.0, 544.0], abs=0.02)
    with pytest.raises(ValueError, match=r"shows a rectangle of .* either side could have the size of 8 mm"):
        find_widths(pictures[1:2])


@pytest.mark.parametrize("wrong", [0.8, 80.0, 8.0 / 25.4])
def test_a_size_in_another_unit_is_refused(wrong: float) -> None:
    right = [seen("bar", size, seed, noise_grey=1.0) for seed, size in enumerate((3.0, 8.0, 14.0))]
    right[1] = KnownSize("odd.png", "bar", wrong, 0.001, right[1].grey)
    with pytest.raises(ValueError, match=r"odd\.png would have to be 8 mm instead of .* a factor of (ten|25\.4)"):
        find_widths(right)


def test_pictures_of_two_scales_are_refused() -> None:
    pictures = [seen("bar", size, seed, noise_grey=1.0) for seed, size in enumerate((3.0, 8.0, 14.0))]
    pictures[2] = KnownSize("moved.png", "bar", 12.0, 0.001, pictures[2].grey)
    with pytest.raises(ValueError, match=r"moved\.png of 12 mm gives .* px/mm and the others give 34"):
        find_widths(pictures)


def test_nothing_and_half_an_object_are_refused() -> None:
    blank = np.full((480, 640), 128, dtype=np.uint8)
    with pytest.raises(ValueError, match="there is no straight edge in the picture"):
        find_widths([KnownSize("blank.png", "bar", 5.0, 0.001, blank)])
    cut = seen("bar", 14.0, 1, noise_grey=1.0).grey[:, :320]
    with pytest.raises(ValueError, match=r"shows 1 straight edge without a parallel edge.* away from the border"):
        find_widths([KnownSize("cut.png", "bar", 14.0, 0.001, np.ascontiguousarray(cut))])


def test_a_rectangle_cut_by_the_border_is_not_taken_for_its_other_side() -> None:
    scene = Scene(light=Light(200.0), behind=(Patch(bar(476.0, 300.0, x_px=500.0, y_px=240.0), 40.0),))
    grey = render(scene, Camera(noise_grey=1.0), np.random.default_rng(1))
    with pytest.raises(ValueError, match=r"shows three sides of a rectangle, .* may extend beyond the border"):
        find_widths([KnownSize("cut.png", "bar", 14.0, 0.001, grey)])
    # The same two sides, where the user says that they are meant; and a pin that is clearly longer than it is wide.
    (meant,) = find_widths([KnownSize("cut.png", "bar", 9.0, 0.001, grey)], region=(300, 0, 340, 480))
    assert meant.width_px == pytest.approx(300.0, abs=0.02)
    scene = Scene(light=Light(200.0), behind=(Patch(bar(100.0, 500.0, x_px=300.0, y_px=50.0), 40.0),))
    pin = render(scene, Camera(noise_grey=1.0), np.random.default_rng(1))
    assert find_widths([KnownSize("pin.png", "bar", 3.0, 0.001, pin)])[0].width_px == pytest.approx(100.0, abs=0.02)


def test_a_saturated_flank_is_refused() -> None:
    scene = Scene(
        light=Light(ground=250.0, exposure=1.4), behind=(Patch(bar(170.0, 640.0, x_px=320.0, y_px=240.0), 40.0),)
    )
    grey = render(scene, Camera(blur_px=1.5, noise_grey=2.0), np.random.default_rng(1))
    with pytest.raises(ValueError, match=r"over\.png is clipped at the sensor's full scale.*reduce the exposure"):
        find_widths([KnownSize("over.png", "bar", 5.0, 0.001, grey)])
