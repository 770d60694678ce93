"""One polarity for a whole recording: the majority of the first frames decides, and all frames stay in order."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.measuring.frame_loop import VOTERS, one_polarity
from fingervision.rendering import Camera, Light, render, two_fingers
from fingervision.vision.pipeline import Settings

SETTINGS = Settings(10.2)
RNG = np.random.default_rng(95)
CAMERA = Camera(blur_px=0.9, noise_grey=2.0)
DARK = render(two_fingers(150.0, radius_px=30.0), CAMERA, RNG)
LIGHT = render(two_fingers(150.0, radius_px=30.0, light=Light(ground=40.0, fingers=200.0)), CAMERA, RNG)
BLACK = np.zeros_like(DARK)


def polarities(pictures: list[np.ndarray]) -> tuple[list[bool | None], Counter[str]]:
    votes: Counter[str] = Counter()
    found = one_polarity((Frame(picture, k) for k, picture in enumerate(pictures)), SETTINGS, votes)
    outcomes = [(item.index, outcome) for item, outcome in found]
    assert [index for index, _ in outcomes] == list(range(len(pictures)))
    return [o.light_gap if isinstance(o, GapMeasurement) else None for _, o in outcomes], votes


def test_the_majority_of_the_first_frames_decides_for_all() -> None:
    found, votes = polarities([LIGHT, DARK, DARK] + [DARK] * VOTERS + [LIGHT])
    assert False not in found
    assert found[0] is None
    assert found[-1] is None
    assert votes == {"dark": VOTERS - 1, "light": 1}


def test_light_fingers_stay_light() -> None:
    found, votes = polarities([BLACK, LIGHT, LIGHT, BLACK])
    assert found == [None, False, False, None]
    assert votes == {"light": 2}


def test_a_tie_goes_to_dark_fingers_which_is_the_usual_set_up() -> None:
    assert polarities([LIGHT, DARK])[0] == [None, True]


def test_frames_before_the_first_number_come_at_once() -> None:
    read = []

    def source() -> Iterator[Frame | LostFrame]:
        for k, picture in enumerate([BLACK, BLACK, DARK]):
            read.append(k)
            yield Frame(picture, k)

    found = one_polarity(source(), SETTINGS, Counter())
    next(found)
    assert read == [0]


def test_what_was_stated_is_not_voted_about() -> None:
    votes: Counter[str] = Counter()
    settings = Settings(10.2, fingers_are_dark=False)
    found = [o for _, o in one_polarity([Frame(DARK, 0), LostFrame(1, None, Status.DAMAGED, "x")], settings, votes)]
    assert not isinstance(found[0], GapMeasurement)
    assert isinstance(found[1], LostFrame)
    assert not votes
