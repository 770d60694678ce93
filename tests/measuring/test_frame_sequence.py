"""Rows that the frames before and after them contradict are refused; true motions, however fast, never are."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.measuring.beside_damage import confirmed_beside_damage
from fingervision.measuring.frame_sequence import Judged, in_sequence
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

SETTINGS, COUNT, SIZE_PX = Settings(6.0), 14, (320, 240)
Change = Callable[[int, np.ndarray], None]


@lru_cache
def picture(gap_px: float, seed: int) -> np.ndarray:
    scene = two_fingers(gap_px, below_tip_px=6.0, width_px=60.0, frame=SIZE_PX)
    return render(scene, Camera(noise_grey=1.0), np.random.default_rng(seed))


def refused(gaps_px: list[float], change: Change, has_times: bool = True, quarter: int = 0) -> list[int]:
    """Numbers of the refused frames; every frame alone has a gap, also a changed one."""
    results = []
    for k, gap_px in enumerate(gaps_px):
        levels = picture(gap_px, k % 3).copy()
        change(k, levels)
        frame = Frame(np.ascontiguousarray(np.rot90(levels, quarter)), k, k / 25 if has_times else None)
        results.append((frame, measure_frame(frame, SETTINGS)))
    assert all(isinstance(outcome, GapMeasurement) for _, outcome in results)
    judged = list(in_sequence(results))
    assert [item.index for item, _ in judged] == list(range(len(gaps_px)))
    return [item.index for item, outcome in judged if isinstance(outcome, LostFrame)]


def torn(levels: np.ndarray, by_px: int = 20, until: int = 130) -> None:
    """The upper part of the right finger stands where an older picture had it, as in memory that is not renewed."""
    levels[:until, 160:-by_px] = levels[:until, 160 + by_px :].copy()


MOTIONS = {
    "rest": [70.0] * COUNT,
    "slow": [70.0 + 0.5 * k for k in range(COUNT)],
    "steps": [70.0 + 24.0 * (k // 5 % 2) for k in range(COUNT)],
    "vibration": [70.0 + 15.0 * np.sin(2.6 * k) for k in range(COUNT)],
    "shock": [70.0 + 30.0 * (k == 6) for k in range(COUNT)],
}


@pytest.mark.parametrize("which", [{0}, {6}, {6, 7}, {COUNT - 1}, {3, 9}])
@pytest.mark.parametrize("motion", ["rest", "slow", "steps"])
def test_fingers_that_break_in_some_frames_are_no_fingers(motion: str, which: set[int]) -> None:
    gaps_px = MOTIONS[motion]
    found = refused(gaps_px, lambda k, levels: torn(levels, 20 + 5 * (k % 2)) if k in which else None)
    assert set(found) == which


@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_every_direction_is_judged_alike(quarter: int) -> None:
    change = lambda k, levels: torn(levels) if k == 6 else None  # noqa: E731 - one line of a table
    assert refused(MOTIONS["slow"], change, quarter=quarter) == [6]
    assert refused(MOTIONS["shock"], lambda k, levels: None, quarter=quarter) == []


@pytest.mark.parametrize("motion", MOTIONS)
def test_true_motions_are_never_refused(motion: str) -> None:
    assert refused(MOTIONS[motion], lambda k, levels: None) == []


@pytest.mark.parametrize(("blur_px", "step_px"), [(0.7, 0.6), (1.6, 2.0)])
@pytest.mark.parametrize("is_upright", [True, False])
def test_fingers_that_close_and_open_are_measured_until_they_touch(
    blur_px: float, step_px: float, is_upright: bool
) -> None:
    # The edges of a gap of a few blurs darken the ground between them; once they touch, no picture alone tells one
    # finger from two.
    gaps_px = step_px * np.array([8, 6, 4, 3, 2, 1, 0, 0, 1, 2, 3, 4, 6])
    camera, results = Camera(blur_px=blur_px, noise_grey=1.0), []
    for k, gap_px in enumerate(gaps_px):
        scene = two_fingers(gap_px, below_tip_px=6.0, width_px=60.0, frame=SIZE_PX)
        levels = render(scene, camera, np.random.default_rng(k))
        frame = Frame(levels if is_upright else np.ascontiguousarray(np.rot90(levels)), k, k / 25)
        results.append((frame, measure_frame(frame, SETTINGS)))
    statuses = [outcome.status for _, outcome in in_sequence(results)]
    assert statuses[6:8] == [Status.TOUCHING] * 2
    assert {each for each, gap_px in zip(statuses, gaps_px, strict=True) if gap_px > 2.0 * blur_px} == {Status.OK}
    assert {*statuses} == {Status.OK, Status.TOUCHING}


def round_fingers(gaps_px: list[float], change: Change) -> list[Judged]:
    """Results of fingers whose straight sides touch first: at the measuring height their round tips are apart."""
    results: list[Judged] = []
    for k, gap_px in enumerate(gaps_px):
        scene = two_fingers(gap_px, below_tip_px=6.0, width_px=60.0, radius_px=14.0, frame=SIZE_PX)
        levels = render(scene, Camera(blur_px=0.9, noise_grey=1.0), np.random.default_rng(k))
        change(k, levels)
        frame = Frame(levels, k, k / 25)
        results.append((frame, measure_frame(frame, SETTINGS)))
    return list(in_sequence(results))


def test_round_fingers_are_measured_while_their_straight_sides_touch_and_part() -> None:
    opening = [2.3, 3.9, 5.9, 8.0, 10.3, 12.7, 15.4]
    judged = round_fingers([*opening[::-1], *[0.0] * 5, *opening], lambda k, levels: None)
    assert {outcome.status for _, outcome in judged} <= {Status.OK, Status.TOUCHING}
    assert all(isinstance(outcome, GapMeasurement) for _, outcome in judged[-len(opening) + 1 :])


def test_round_fingers_that_nearly_touch_are_refused_where_they_break() -> None:
    judged = round_fingers([5.0] * 12, lambda k, levels: torn(levels, 5) if k == 6 else None)
    assert [item.index for item, outcome in judged if isinstance(outcome, LostFrame)] == [6]


@pytest.mark.parametrize("covered", [slice(160, None), slice(125, 195)], ids=["other finger gone", "gap filled"])
def test_what_has_not_the_width_of_both_fingers_does_not_touch(covered: slice) -> None:
    results = []
    for k in range(4):
        levels = picture(70.0, k).copy()
        if k == 2:
            levels[:, covered] = levels[:, :1] if covered.stop is None else levels[200, 100]
        frame = Frame(levels, k, k / 25)
        results.append((frame, measure_frame(frame, SETTINGS)))
    assert [outcome.status for _, outcome in in_sequence(results)] == [outcome.status for _, outcome in results]


@pytest.mark.parametrize("radius_px", [8.0, 14.0])
def test_rounded_tips_that_stand_between_rows_are_not_torn(radius_px: float) -> None:
    # The stage turns, and the measuring height of one frame is rounded to another row than that of its neighbours.
    results = []
    for k in range(COUNT):
        gap_px, tip_px = 70.0 + 2.0 * (k == 6), 70.3 + 0.3 * (k == 6)
        scene = two_fingers(
            gap_px, below_tip_px=6.0, width_px=60.0, radius_px=radius_px, tip_at_px=tip_px, frame=SIZE_PX
        )
        frame = Frame(render(scene, Camera(noise_grey=1.0), np.random.default_rng(k)), k, k / 25)
        results.append((frame, measure_frame(frame, SETTINGS)))
    assert all(isinstance(outcome, GapMeasurement) for _, outcome in in_sequence(results))


def test_a_push_at_the_camera_a_flash_and_defocus_change_no_finger() -> None:
    def change(k: int, levels: np.ndarray) -> None:
        if k in (4, 5):
            levels[:] = np.roll(levels, (7, -5), axis=(0, 1))
        if k == 8:
            levels[:] = levels // 2
        if k == 10:  # the fingers run across rows, so that this blurs their edges symmetrically
            levels[:, 3:-3] = sum(levels[:, 3 + i : 317 + i].astype(int) for i in range(-3, 4)) // 7

    assert refused([*[70.0] * 10, 82.0, *[70.0] * 3], change) == []


def test_a_change_that_lasts_is_believed() -> None:
    assert refused(MOTIONS["rest"], lambda k, levels: torn(levels) if k >= 6 else None) == []


def test_pictures_without_times_are_not_compared() -> None:
    assert refused(MOTIONS["rest"], lambda k, levels: torn(levels) if k == 6 else None, has_times=False) == []


@pytest.mark.parametrize("first_row", [0, 20])
def test_a_motion_in_a_picture_that_is_torn_between_two_rows_is_no_motion(first_row: int) -> None:
    # A decoder without checksums that loses its place shows all that follows elsewhere, and at other levels. A change
    # of the light is that of the whole picture.
    def change(k: int, levels: np.ndarray) -> None:
        if k == 6:
            levels[first_row:] -= 24

    assert refused(MOTIONS["shock"], change) == ([6] if first_row else [])


def test_fingers_that_the_border_cuts_in_one_frame_are_not_confirmed_by_the_others() -> None:
    def change(k: int, levels: np.ndarray) -> None:
        if k == 6:
            levels[:] = np.roll(levels, 155, axis=0)
            levels[:, :160] = np.roll(levels[:, :160], -20, axis=1)

    assert refused(MOTIONS["rest"], change) == [6]


def test_fingers_that_leave_their_tips_behind_have_not_moved() -> None:
    # Below some row, a decoder without checksums goes on with an earlier part of the picture, displaced.
    def change(k: int, levels: np.ndarray) -> None:
        if k == 6:
            ground = levels[:25].copy()
            levels[90:] = levels[60:-30].copy()
            levels[90:, :160] = np.roll(levels[90:, :160], -40, axis=1)
            levels[90:, 160:] = np.roll(levels[90:, 160:], 40, axis=1)
            levels[68:93] = ground

    assert refused(MOTIONS["slow"], change) == [6]


def test_an_edge_that_another_model_moves_in_one_frame_is_in_the_same_picture() -> None:
    results = []
    for k, gap_px in enumerate(MOTIONS["slow"]):
        frame = Frame(picture(gap_px, k % 3), k, k / 25)
        found = measure_frame(frame, SETTINGS)
        assert isinstance(found, GapMeasurement)
        if k % 5 == 3:
            left = replace(found.left, x_px=found.left.x_px - 0.5, tip_px=found.left.tip_px - 0.4)
            right = replace(found.right, x_px=found.right.x_px + 0.5, tip_px=found.right.tip_px - 0.4)
            found = replace(found, left=left, right=right)
        results.append((frame, found))
    assert all(isinstance(outcome, GapMeasurement) for _, outcome in in_sequence(results))


def test_one_finger_alone_does_not_move_along_itself() -> None:
    # A page of raw video that stands elsewhere leaves straight sides where they are, and moves only the tips.
    def change(k: int, levels: np.ndarray) -> None:
        if k == 6:
            levels[:, :160] = np.roll(levels[:, :160], -6, axis=0)
            levels[-6:] = levels[-7]
        if k == 9:  # a push at the camera moves both
            levels[:] = np.roll(levels, -6, axis=0)
            levels[-6:] = levels[-7]

    assert refused(MOTIONS["slow"], change) == [6]


def kept_beside_damage(gaps_px: list[float], shown: dict[int, int], lost: set[int]) -> set[int]:
    """Numbers of the frames that keep their gap if frames `lost` are damaged, and others show an older picture."""
    results: list[Judged] = []
    for k in range(len(gaps_px)):
        frame = Frame(picture(gaps_px[shown.get(k, k)], k % 3), k, k / 25)
        outcome = LostFrame(k, k / 25, Status.DAMAGED, "damaged") if k in lost else measure_frame(frame, SETTINGS)
        results.append((frame, outcome))
    judged = list(confirmed_beside_damage(in_sequence(results)))
    assert [item.index for item, _ in judged] == list(range(len(gaps_px)))
    return {item.index for item, outcome in judged if isinstance(outcome, GapMeasurement)}


SLOW = [70.0 + 0.5 * k for k in range(20)]


@pytest.mark.parametrize(("shown", "lost"), [({10: 3}, {11}), ({10: 3}, {9}), ({10: 6}, {8, 9, 11}), ({19: 12}, {18})])
def test_an_older_picture_beside_damaged_ones_is_refused(shown: dict[int, int], lost: set[int]) -> None:
    assert kept_beside_damage(SLOW, shown, lost) == {*range(20)} - lost - {*shown}


@pytest.mark.parametrize("lost", [{9}, {10}, {6, 7, 9}, {12, 14}, {0}, {19}])
@pytest.mark.parametrize(
    "gaps_px",
    [
        [70.0] * 20,
        SLOW,
        [70.0 + 15.0 * np.sin(1.1 * k) for k in range(20)],
        [70.0 + 0.5 * abs((k + 5) % 10 - 5) for k in range(20)],
    ],
    ids=["rest", "slow", "vibration", "there and back"],
)
def test_true_pictures_beside_damaged_ones_are_kept(gaps_px: list[float], lost: set[int]) -> None:
    assert kept_beside_damage(gaps_px, {}, lost) == {*range(20)} - lost


def test_a_measuring_height_on_the_top_of_a_tip_leaves_the_outlines_in_the_picture() -> None:
    """A scale stated in another unit measures a hundredth of a pixel below round tips, where slopes are any."""
    sample = Path(__file__).parents[2] / "sample_frames" / "opening" / "opening.mp4"
    found = fv.measure(sample, px_per_mm=0.034, frames=(236, 250))
    assert sum(found.counts.values()) == 15
