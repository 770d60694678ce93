"""Pictures and models in memory: streams of pictures, functions as models, results that go to other processes."""

import pickle
import tracemalloc
from collections.abc import Iterable, Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import calib
import fingervision as fv
from fingervision.rendering import Camera, render, two_fingers
from fingervision.testing import FrameSourceContract, run

SIZE = (320, 240)
TABLE = {"input_mm": [-0.5, 2.0], "gap_mm": [0.5, 20.5]}
LONGEST_REPR = 600


def pictures(count: int, first_px: float = 60.0) -> Iterator[np.ndarray]:
    noise = np.random.default_rng(4)
    for index in range(count):
        scene = two_fingers(first_px + 0.1 * (index % 50), below_tip_px=10.2, width_px=60.0, frame=SIZE)
        yield render(scene, Camera(), noise)


def test_a_generator_gives_the_numbers_of_the_array() -> None:
    stack = np.stack(list(pictures(4)))
    whole = fv.measure(stack, px_per_mm=34.0, rate_hz=25.0)
    streamed = fv.measure(pictures(4), px_per_mm=34.0, rate_hz=25.0)
    listed = fv.measure(list(stack), px_per_mm=34.0, times_s=[0.0, 0.04, 0.08, 0.12])
    assert streamed.rows == whole.rows
    assert listed.rows == whole.rows
    assert np.array_equal(listed.picture(2), whole.picture(2))
    with pytest.raises(fv.StateError, match="once"):
        streamed.picture(2)


def test_a_generator_of_any_length_needs_the_memory_of_a_few_pictures() -> None:
    learnt, held = 20, []  # the camera is learnt from pictures before this one, and they are let go

    def watched() -> Iterator[np.ndarray]:
        for index, picture in enumerate(pictures(learnt + 40)):
            if index == learnt:
                tracemalloc.start()
            if index >= learnt:
                held.append(tracemalloc.get_traced_memory()[0])
            yield picture

    fv.measure(watched(), px_per_mm=34.0)
    tracemalloc.stop()
    # The first fill the queue of pictures that wait; twenty more would take twenty times their size if they were kept.
    assert max(held) - max(held[:20]) < 12 * SIZE[0] * SIZE[1]


@pytest.mark.parametrize(
    ("source", "fact"),
    [
        ([], "none"),
        ([1, 2], "int"),
        ([np.zeros((3, 4, 5, 6), np.uint8)], "shape (3, 4, 5, 6)"),
        ([np.zeros((90, 80), np.uint8), np.zeros((90, 90), np.uint8)], "picture 1"),
        ({"a": 1}, "dict"),
        (object(), "object"),
    ],
    ids=["empty", "numbers", "stacks", "sizes", "mapping", "nothing"],
)
def test_what_is_no_picture_is_named(source: object, fact: str) -> None:
    with pytest.raises(fv.ArgumentError) as told:
        fv.measure(source, px_per_mm=34.0)  # type: ignore[arg-type]
    assert fact in str(told.value)


def test_a_source_of_ones_own_is_told_what_it_lacks() -> None:
    class Undescribed:
        description = "none"

        def __iter__(self) -> Iterator[fv.Frame]:
            yield from ()

    class NotIterable:
        description = None

    with pytest.raises(fv.ArgumentError, match="Description"):
        fv.measure(Undescribed(), px_per_mm=34.0)  # type: ignore[arg-type]
    with pytest.raises(fv.ArgumentError, match="__iter__"):
        fv.measure(NotIterable(), px_per_mm=34.0)  # type: ignore[arg-type]


DESCRIBED = fv.Description("mine", "made up", "none", fv.Coding.LOSSLESS, *SIZE, None, True, None)
EMPTY = np.full(SIZE[::-1], 200, np.uint8)


class Own:
    """A frame source in which one thing may be wrong."""

    def __init__(self, frames: Iterable[object], **described: object) -> None:
        self.frames, self.closed = frames, 0
        self.description = replace(DESCRIBED, **described)  # type: ignore[arg-type]

    def __iter__(self) -> Iterator[object]:
        return iter(self.frames)

    def close(self) -> None:
        self.closed += 1


@pytest.mark.parametrize(
    ("frames", "described", "fact"),
    [
        ([fv.Frame(EMPTY, 0, 1.0), fv.Frame(EMPTY, 1, 0.5)], {}, "0.5 s after 1 s"),
        ([fv.Frame(EMPTY, 0, 0.0), fv.Frame(EMPTY, 1, 0.0)], {}, "0 s after 0 s"),
        ([fv.Frame(EMPTY, 0, float("nan"))], {}, "nan"),
        ([fv.Frame(EMPTY, 0, 0.0), fv.Frame(EMPTY, 2, 1.0)], {}, "index 2"),
        ([fv.Frame(EMPTY[:100], 0, 0.0)], {}, "320 x 100"),
        ([fv.Frame(EMPTY, 0, 0.0)], {"width_px": 999}, "999 x 240"),
        ([fv.Frame(EMPTY, 0, 0.0)], {"has_times": False}, "without times"),
        ([fv.Frame(EMPTY, 0)], {}, "with times"),
        ([EMPTY], {}, "ndarray"),
        ([fv.Frame(EMPTY / 255.0, 0, 0.0)], {}, "float64"),  # type: ignore[arg-type]
        ([fv.Frame(EMPTY, 0, 0.0, "lossless")], {}, "Coding"),  # type: ignore[arg-type]
        ([fv.LostFrame(0, 0.0, fv.Status.OK, "fine")], {}, "DAMAGED"),
        ([fv.Frame(EMPTY, 0, 0.0)], {"height_px": 240.0}, "height_px"),
        ([fv.Frame(EMPTY, 0, 0.0)], {"coding": "lossless"}, "coding"),
        ([], {}, "none"),
    ],
)
def test_measure_and_contract_hold_a_source_to_what_it_says(frames: list, described: dict, fact: str) -> None:
    source = Own(frames, **described)
    with pytest.raises(fv.ArgumentError) as told:
        fv.measure(source, px_per_mm=34.0)  # type: ignore[arg-type]
    kind = SimpleNamespace(accepts=lambda name: name == "it", open_frames=lambda name, wish: source)
    failed = run(FrameSourceContract, kind=kind, name="it").values()
    assert fact in str(told.value)
    assert any(fact in sentence for sentence in failed)


def test_a_source_without_times_gets_those_of_the_rate_and_is_closed_after_each_reading() -> None:
    frames = [fv.Frame(pixels, index) for index, pixels in enumerate(pictures(3))]
    source = Own([*frames, fv.LostFrame(3, None, fv.Status.DAMAGED, "It was lost.")], has_times=False)
    measured = fv.measure(source, px_per_mm=34.0, rate_hz=25.0)  # type: ignore[arg-type]
    assert [row.time_s for row in measured] == pytest.approx([0.0, 0.04, 0.08, 0.12])
    assert source.closed == 1
    assert measured.picture(2).shape[:2] == SIZE[::-1]
    assert source.closed == 2
    with pytest.raises(fv.UsageError, match="times of its own"):
        fv.measure(Own([fv.Frame(EMPTY, 0, 0.0)]), px_per_mm=34.0, rate_hz=25.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("is_described", [False, True])
def test_a_source_may_use_its_array_again_for_the_next_picture(is_described: bool) -> None:
    array = np.empty(SIZE[::-1], np.uint8)

    def again() -> Iterator[np.ndarray]:
        for index in range(12):
            scene = two_fingers(60.0 + 2.0 * index, below_tip_px=10.2, width_px=60.0, frame=SIZE)
            array[:] = render(scene, Camera(), np.random.default_rng(index))
            yield array

    source = Own((fv.Frame(each, index) for index, each in enumerate(again())), has_times=False)
    measured = fv.measure(source if is_described else again(), px_per_mm=34.0)  # type: ignore[arg-type]
    assert measured.gap_mm == pytest.approx((60.0 + 2.0 * np.arange(12)) / 34.0, abs=0.01)


def test_times_are_one_for_each_picture() -> None:
    stack = list(pictures(3))
    timed = fv.measure(stack, px_per_mm=34.0, times_s=(0.1 * index for index in range(3)))
    assert timed.time_s == pytest.approx([0.0, 0.1, 0.2])
    for count in (2, 4):
        with pytest.raises(fv.ArgumentError, match="times_s"):
            fv.measure(iter(stack), px_per_mm=34.0, times_s=range(count))
    with pytest.raises(fv.ArgumentError, match="description"):
        fv.measure((fv.Frame(each, 0) for each in stack), px_per_mm=34.0)  # type: ignore[misc]


def line(time_s: np.ndarray, input_mm: np.ndarray) -> np.ndarray:
    return 4.5 + 8.0 * input_mm


def driven(seed: int = 2) -> dict[str, np.ndarray]:
    """Two strokes of a gripper with a play of 0.04 mm, 2 um of noise."""
    time_s = np.arange(200) / 25.0
    input_mm = 0.7 - 0.7 * np.cos(2.0 * np.pi * time_s / 4.0)
    at_mm, reached = input_mm[0], []
    for value in input_mm:
        at_mm = min(max(at_mm, value - 0.02), value + 0.02)
        reached.append(at_mm)
    gap_mm = 4.5 + 8.0 * np.array(reached) + np.random.default_rng(seed).normal(0.0, 0.002, time_s.size)
    return {"time_s": time_s, "input_mm": input_mm, "gap_mm": gap_mm}


@pytest.fixture(scope="module")
def of_table() -> fv.Diagnosis:
    return fv.diagnose(driven(), TABLE)


def test_a_function_is_a_model_like_its_table(tmp_path, of_table: fv.Diagnosis) -> None:
    found = fv.diagnose(driven(), line)
    assert [effect.name for effect in found.effects] == ["backlash"]
    play = found.effects[0].parameters["play_mm"]
    assert play.u is not None
    assert abs(play.value - 0.04) < 3.0 * play.u
    assert abs(play.value - of_table.effects[0].parameters["play_mm"].value) < 0.1 * play.u
    found.save(tmp_path / "diagnosed")
    saved = fv.read_model(tmp_path / "diagnosed" / "model.toml")
    inputs = np.linspace(0.0, 1.4, 15)
    assert np.allclose(saved.base.respond(inputs).gap_mm, line(inputs, inputs), atol=1e-6)
    assert "function line" in (tmp_path / "diagnosed" / "simulation.csv").read_text().splitlines()[0]


@pytest.mark.parametrize(
    ("function", "fact"),
    [
        (lambda time_s, input_mm: 3.0, "a single number"),
        (lambda time_s, input_mm: {"x": input_mm}, "gap_mm"),
        (lambda time_s, input_mm: 1 / 0, "ZeroDivisionError"),
        (lambda time_s: time_s, "TypeError"),
        (lambda time_s, input_mm: np.nan * input_mm, "NaN"),
    ],
    ids=["scalar", "names", "error", "arguments", "nan"],
)
def test_a_function_that_is_no_model_is_told_why(function, fact: str) -> None:
    with pytest.raises(fv.ModelError) as told:
        fv.simulate(function, {"time_s": [0.0, 1.0, 2.0], "input_mm": [0.0, 0.5, 1.0]})
    assert fact in str(told.value)


MASKED = np.ma.masked_array(4.0 + np.arange(10.0), mask=np.arange(10) == 9)


@pytest.mark.parametrize(
    ("gap_mm", "fact"),
    [
        (MASKED.filled() + 1j, "real numbers in column gap_mm"),
        (MASKED > 6.0, "real numbers in column gap_mm"),
        (np.ma.masked_all(10), "but has 0"),
        (4.0, "list or an array"),
    ],
    ids=["complex", "truth", "masked", "scalar"],
)
def test_a_column_that_holds_no_numbers_is_named(gap_mm: object, fact: str) -> None:
    inputs = 0.1 * np.arange(10)
    with pytest.raises((fv.ArgumentError, fv.DataError), match=fact):
        fv.diagnose({"input_mm": inputs, "gap_mm": gap_mm}, TABLE)


def test_a_masked_value_is_a_missing_one() -> None:
    from fingervision.interface.column_tables import measured_from_columns

    inputs = 0.1 * np.arange(10)
    kept = {"input_mm": inputs[:9], "gap_mm": MASKED.data[:9]}
    masked, left_out = (measured_from_columns(table) for table in ({"input_mm": inputs, "gap_mm": MASKED}, kept))
    assert np.array_equal(masked.gap_mm, left_out.gap_mm)
    assert np.array_equal(masked.input_mm, left_out.input_mm)


def test_results_pickle_and_print_in_few_words(of_table: fv.Diagnosis) -> None:
    measured = fv.measure(list(pictures(3)), px_per_mm=34.0, u_px_per_mm=0.01, rate_hz=25.0)
    found = of_table
    results = [
        measured, measured.budget, found, found.report, found.corrected_model, fv.compare(driven(), TABLE),
        fv.simulate(line, {"time_s": [0.0, 1.0], "input_mm": [0.0, 1.0]}), found.found, fv.effects.backlash,
        fv.inspect(list(pictures(3)), px_per_mm=34.0).sample,
    ]  # fmt: skip
    for each in results:
        again = pickle.loads(pickle.dumps(each))
        assert repr(again) == repr(each)
        assert len(repr(each)) < LONGEST_REPR
    assert pickle.loads(pickle.dumps(measured)).rows == measured.rows
    assert pickle.loads(pickle.dumps(found)).save is not None


def test_a_measured_generator_pickles_without_its_pictures() -> None:
    again = pickle.loads(pickle.dumps(fv.measure(pictures(2), px_per_mm=34.0)))
    assert again.counts == {"ok": 2}
    with pytest.raises(fv.StateError):
        again.picture(1)


def test_bars_in_pictures_give_the_scale_in_one_call() -> None:
    def bar(width_px: float) -> np.ndarray:
        away = np.abs(np.arange(400) - 199.5) - 0.5 * width_px
        return np.rint(np.tile(200.0 - 150.0 * np.clip(0.5 - away, 0.0, 1.0), (300, 1))).astype(np.uint8)

    known = [calib.KnownSize(f"{mm} mm", "bar", mm, 0.001, bar(40.0 * mm)) for mm in (3.0, 5.0, 7.0)]
    fit = calib.scale_from_pictures(known)
    assert abs(fit.calibration.px_per_mm - 40.0) < 3.0 * fit.calibration.u_px_per_mm
    with pytest.raises(calib.CalibrationError, match="200x300"):
        calib.scale_from_pictures([known[0], calib.KnownSize("half", "bar", 3.0, 0.001, bar(120.0)[:, 100:300])])
    with pytest.raises(calib.CalibrationError, match=", 3"):
        calib.KnownSize("colours", "bar", 3.0, 0.001, np.stack([bar(120.0)] * 3, axis=2))
