"""Step data: the permitted contents of a file, and the limits of the stage; each refusal is one sentence."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.errors import FingervisionError
from fingervision.domain.step_data import Coordinates, CycleTime, Operation, SpeedEntry, Step, StepData
from fingervision.storage.recipe_toml import read_steps, write_steps
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.manual.step_running import draw_steps, steps_table
from fingervision.testbed.motion.step_checks import planned_sequence

LIMITS = StageLimits(lower_mm=0.0, upper_mm=10.0, speed_mm_s=400.0, force_n=5.5)
GOOD = """schema = 1
name = "open, push, close"
[[step]]
target_mm = 5.0
load_kg = 0.2
positioning_time_s = 0.2
[[step]]
target_mm = 0.5
coordinates = "relative"
operation = "pushing"
pushing_force_n = 3.0
load_kg = 0.2
speed_mm_s = 20.0
acceleration_mm_s2 = 1000.0
deceleration_mm_s2 = 500.0
[[step]]
target_mm = 0.0
load_kg = 0.2
positioning_time_s = 0.3
"""


def sentence_of(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FingervisionError) as raised:
        planned_sequence(read_steps(path), LIMITS)
    return str(raised.value)


def test_steps_follow_each_other_from_where_the_last_one_ended(tmp_path: Path) -> None:
    path = tmp_path / "steps.toml"
    path.write_text(GOOD, encoding="utf-8")
    data = read_steps(path)
    motions = planned_sequence(data, LIMITS)
    assert [(each.from_mm, each.to_mm) for each in motions] == [(0.0, 5.0), (5.0, 5.5), (5.5, 0.0)]
    assert motions[1].force_n == 3.0
    # Acceleration 4 s / T^2 for s = 5 mm in T = 0.2 s: 0.5 m/s2, with a load of 0.2 kg.
    assert motions[0].force_n == pytest.approx(0.1)
    table = steps_table(motions).splitlines()
    assert len(table) == 4
    assert "pushing 3 N" in table[2]
    draw_steps(tmp_path / "steps.png", data.name, motions, LIMITS)
    assert (tmp_path / "steps.png").read_bytes().startswith(b"\x89PNG")


times = st.builds(CycleTime, st.floats(1e-3, 1e3))
speeds = st.builds(SpeedEntry, *(st.floats(1e-3, 1e5) for _ in range(3)))
names = st.text(st.characters(codec="utf-8"), max_size=20)


@st.composite
def step_data(draw: st.DrawFn) -> StepData:
    numbers = draw(st.lists(st.integers(1, 15), min_size=1, max_size=15, unique=True))
    steps = {}
    for number in sorted(numbers):
        operation = draw(st.sampled_from(Operation))
        steps[number] = Step(
            target_mm=draw(st.floats(-10.0, 10.0)),
            load_kg=draw(st.floats(1e-3, 10.0)),
            entry=draw(times | speeds),
            coordinates=draw(st.sampled_from(Coordinates)),
            operation=operation,
            pushing_force_n=draw(st.floats(0.1, 5.5)) if operation is Operation.PUSHING else None,
        )
    sequence = tuple(draw(st.lists(st.sampled_from(sorted(numbers)), max_size=20)))
    return StepData(draw(names), steps, sequence, draw(st.floats(0.0, 10.0)))


@given(data=step_data())
def test_what_is_written_is_read_back(data: StepData, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("steps") / "steps.toml"
    write_steps(path, data)
    assert read_steps(path) == data


def test_sixteen_steps_are_refused(tmp_path: Path) -> None:
    step = "[[step]]\ntarget_mm = 1.0\nload_kg = 0.1\npositioning_time_s = 1.0\n"
    said = sentence_of(tmp_path / "steps.toml", "schema = 1\n" + 16 * step)
    assert said == (
        f"{tmp_path / 'steps.toml'} must hold 1 to 15 tables [[step]], which is how many the controller stores, "
        "but holds 16."
    )


def test_a_time_too_short_is_answered_with_the_shortest_and_that_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "steps.toml"
    said = sentence_of(path, GOOD.replace("= 0.2\n[[", "= 0.02\n[["))
    # Distance s = 5 mm with 5.5 N on 0.2 kg (a = 27.5 m/s2): a triangular speed profile takes 2 sqrt(s / a) = 26.97 ms.
    assert said == (
        "positioning_time_s of step 1 must be at least 0.027 s for its travel of 5 mm with a load of 0.2 kg, because "
        "the stage permits at most 400 mm/s and 5.5 N, but is 0.02."
    )
    path.write_text(GOOD.replace("= 0.2\n[[", "= 0.027\n[["), encoding="utf-8")
    assert planned_sequence(read_steps(path), LIMITS)[0].force_n == pytest.approx(5.5, rel=0.01)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("target_mm = 5.0", "target_mm = 12.0",
         "Step 1 must end within the stroke of 0 to 10 mm, but from 0 mm it ends at 12 mm, 2 mm beyond: "
         "change its target_mm."),
        ("target_mm = 0.5", "target_mm = -6.0",
         "Step 2 must end within the stroke of 0 to 10 mm, but from 5 mm it ends at -1 mm, 1 mm beyond: "
         "change its target_mm."),
        ("speed_mm_s = 20.0", "speed_mm_s = 450.0",
         "speed_mm_s of step 2 must be at most 400, but is 450."),
        ("acceleration_mm_s2 = 1000.0", "acceleration_mm_s2 = 40000.0",
         "Step 2 must need at most 5.5 N, but 0.2 kg at 40 m/s2 need 8 N: accelerate and decelerate by at "
         "most 27500 mm/s2."),
        ("pushing_force_n = 3.0", "pushing_force_n = 6.0",
         "Step 2 must push with at most 5.5 N, but pushing_force_n is 6."),
        ("positioning_time_s = 0.2", "positioning_time_s = 0.2\nspeed_mm_s = 3",
         "speed_mm_s in line 7 of {path} must not be given together with positioning_time_s, which determines it: "
         "leave one of the two out."),
        ("positioning_time_s = 0.2", "",
         "[step] in line 3 of {path} must state positioning_time_s, or speed_mm_s, acceleration_mm_s2, "
         "deceleration_mm_s2, but states neither."),
        ("deceleration_mm_s2 = 500.0", "",
         "[step] in line 7 of {path} must state deceleration_mm_s2, but does not: add it."),
        ('operation = "pushing"', "",
         'pushing_force_n in line 11 of {path} must come with operation = "pushing", but the operation is '
         "moving."),
        ("load_kg = 0.2", "load_kg = 0",
         "load_kg in line 5 of {path} must be greater than 0 kg, but is 0."),
        ("target_mm = 5.0", "number = 16\ntarget_mm = 5.0",
         "number in line 4 of {path} must be between 1 and 15, but is 16."),
        ("target_mm = 0.5", "number = 1\ntarget_mm = 0.5",
         "number in line 8 of {path} must differ from the numbers of all earlier steps, but 1 occurs twice."),
        ("name =", "sequence = [1, 4]\nname =",
         "sequence in line 2 of {path} must be a list of the numbers of existing steps (1, 2, 3), but "
         "is [1, 4]."),
        ("target_mm = 5.0", "taget_mm = 5.0",
         "taget_mm in line 4 of {path} is not known: did you mean target_mm?"),
        ("schema = 1", "schema = 2",
         "schema in line 1 of {path} must be at most 1, but is 2: use a newer fingervision."),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_said_in_a_sentence(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "steps.toml"
    assert sentence_of(path, GOOD.replace(old, new, 1)) == said.format(path=path)
