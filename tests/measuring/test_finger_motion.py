"""Where the motion in the frames before leads the fingers, and what is a jump."""

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.measuring.finger_motion import Place, beside_path, jumps

UP = next(iter(Direction))
U_PX = 0.02


def places(px: "np.typing.NDArray[np.float64]") -> list[Place]:
    """Places of fingers that all move by the same path."""
    return [Place(k, UP, np.full(4, at), np.full(4, U_PX)) for k, at in enumerate(px)]


def test_even_acceleration_is_no_jump_at_any_speed_and_what_leaves_it_is_one() -> None:
    frames = np.arange(4.0)
    for acceleration_px in (0.0, 0.3, 5.0, -40.0):
        path = places(7.0 * frames + 0.5 * acceleration_px * frames**2)
        assert not jumps(path[:3], path[3])
        off = Place(3, UP, path[3].px + np.array([0.0, 0.0, 0.6, 0.0]), path[3].u_px)
        assert jumps(path[:3], off)


def test_an_older_picture_in_a_motion_is_a_jump() -> None:
    path = places(51.0 * np.cos(2.0 * np.pi * np.arange(40) / 50.0))
    for k in range(3, 40):
        assert not jumps(path[k - 3 : k], path[k])
        older = Place(k, UP, path[k - 1].px, path[k].u_px)
        if abs(path[k].px[0] - path[k - 1].px[0]) > 0.6:  # where the fingers turn round, both pictures are alike
            assert jumps(path[k - 3 : k], older)


def test_a_parabola_is_not_followed_over_missing_frames() -> None:
    path = places(0.5 * 4.0 * np.arange(7.0) ** 2)
    assert jumps(path[:3], path[6])


def test_fingers_that_point_elsewhere_or_have_no_past_jump() -> None:
    first, second, third = places(np.zeros(3))
    assert jumps([], first)
    other = next(each for each in Direction if each is not UP)
    assert jumps([first, second], Place(2, other, third.px, third.u_px))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_uncertainty_of_the_distance_is_its_scatter(count: int) -> None:
    rng = np.random.default_rng(count)
    off_px = []
    for _ in range(4000):
        path = places(3.0 * np.ones(count + 1))
        noisy = [Place(each.at, UP, each.px + rng.normal(0.0, U_PX, 4), each.u_px) for each in path]
        away_px, u_px = beside_path(noisy[:-1], noisy[-1])
        off_px.append(away_px[0])
    assert np.std(off_px) == pytest.approx(u_px[0], rel=0.05)
