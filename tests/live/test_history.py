"""The history returns the newest rows unchanged, in a fixed amount of memory."""

from dataclasses import replace

from fingervision.domain.status import Status
from fingervision.live.session import History
from fingervision.storage.gaps_csv import GapRow


def row(index: int) -> GapRow:
    if index % 3 == 0:
        return GapRow(index, index / 25, Status.NO_FINGERS)
    time_s = None if index % 5 == 0 else index / 25
    gap = GapRow(index, time_s, Status.OK, 1.0 + index, None, 0.001, 34.0, 0.02, u_shift_px=-0.3, fingers="light")
    return replace(gap, held_px=20.0, held_mm=0.5, input_mm=0.1) if index % 2 else gap


def test_rows_come_back_as_they_were_and_the_oldest_leave() -> None:
    history = History(kept=10)
    for index in range(25):
        history.add(row(index))
    assert list(history.rows()) == [row(index) for index in range(15, 25)]
    assert list(history.rows(after=22)) == [row(index) for index in range(22, 25)]
    assert list(history.rows(after=25)) == []
