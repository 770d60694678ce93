"""Worker processes on this computer: one that dies costs its task one attempt, and no other task anything."""

from pathlib import Path

from fingervision.batch.local_processes import LocalCrew
from fingervision.batch.task import Task
from tests.batch.dying import perform


def test_a_task_whose_process_dies_is_tried_again_and_then_said(tmp_path: Path) -> None:
    names = ["once_a", "plain_b", "never_c", "once_d", "plain_e"]
    for name in names:
        (tmp_path / name).touch()
    tasks = [Task("measure", str(tmp_path / name), (), tmp_path / "out" / name, "") for name in names]
    with LocalCrew(perform, 2) as crew:
        outcomes = dict(crew.outcomes_of(tasks))
    said = [outcomes[number].words for number in range(len(names))]
    assert "ended its process 2 times (signal SIGKILL)" in said[2]
    assert [each for each in said if each is not said[2]] == ["once_a", "plain_b", "once_d", "plain_e"]
