"""The unchanged sketch of the board on an emulated chip: levels of its pins and its messages."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from fingervision.domain.board_settings import SELECT, Role
from fingervision.domain.errors import DeviceError
from fingervision.testbed.board.board import Board, opened
from fingervision.testbed.board.link import ASK_EVERY_S
from fingervision.testbed.board.wire import Levels
from tests.testbed.emulated_board import HERTZ, WIRING, Edge, EmulatedBoard, MotorController
from tests.waiting import until

SELECT_PINS = [WIRING[role].pin for role in SELECT]
DRIVE_PIN, ENABLE_PIN, HOLD_PIN = WIRING[Role.DRIVE].pin, WIRING[Role.ENABLE].pin, WIRING[Role.HOLD].pin
# Period of the board's timer interrupt.
TICK_S = 1e-3
# The board counts microseconds in steps of 4, and an interrupt may wait for another interrupt.
INTERRUPT_S = 50e-6


@pytest.fixture
def controller(emulated: EmulatedBoard) -> Iterator[MotorController]:
    """A motor controller whose steps take 0.1 s."""
    controller = MotorController(emulated, lambda code: 0.1)
    yield controller
    controller.close()


@pytest.fixture
def board(emulated: EmulatedBoard, controller: MotorController) -> Iterator[Board]:
    """The configured board, with a longer time limit than usual, because a loaded computer may answer late."""
    board = opened(emulated.settings(silence_ms=400), emulated.clock).hold()
    board.clear()
    yield board
    board.close()


@pytest.fixture
def strict_board(emulated: EmulatedBoard, controller: MotorController) -> Iterator[Board]:
    """The configured board with its usual time limit."""
    board = opened(emulated.settings(), emulated.clock).hold()
    board.clear()
    yield board
    board.close()


def selected(edge: Edge) -> int:
    return sum((edge.level(pin) or 0) << bit for bit, pin in enumerate(SELECT_PINS))


def wait_for(emulated: EmulatedBoard, board: Board, level: Levels, within_s: float = 2.0) -> None:
    until_s = emulated.clock.now_s() + within_s
    while level not in board.levels:
        assert emulated.clock.now_s() < until_s, board.levels
        board.wait(0.01)


def until_lost(board: Board) -> None:
    while True:
        board.wait(0.05)


def test_select_lines_change_at_once_then_settle_then_drive(emulated: EmulatedBoard, board: Board) -> None:
    since = len(emulated.edges)
    board.run(0b1011, 1.0)
    drive = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 1, since=since)
    before = emulated.edges[since : emulated.edges.index(drive)]
    # One write sets all select lines, so that no intermediate code occurs.
    assert {selected(edge) for edge in before} <= {0, 0b1011}
    assert selected(drive) == 0b1011
    settled = next(edge for edge in before if selected(edge) == 0b1011)
    # The settling time is at least the set value, and longer by at most one period of the timer.
    assert 5 * TICK_S - INTERRUPT_S <= (drive.cycle - settled.cycle) / HERTZ <= 6 * TICK_S + INTERRUPT_S


def test_without_settling_select_and_drive_lines_change_in_one_write(
    emulated: EmulatedBoard, controller: MotorController
) -> None:
    board = opened(emulated.settings(settle_ms=0), emulated.clock).hold()
    since = len(emulated.edges)
    board.run(0b0110, 1.0)
    drive = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 1, since=since)
    assert selected(drive) == 0b0110
    assert [selected(edge) for edge in emulated.edges[since : emulated.edges.index(drive)]] == []
    board.close()


def test_busy_and_alarm_are_read_back(emulated: EmulatedBoard, board: Board) -> None:
    board.run(3, 1.0)
    wait_for(emulated, board, Levels.BUSY_SEEN)
    wait_for(emulated, board, Levels.DRIVE)
    emulated.outside(Role.ALARM, True)
    wait_for(emulated, board, Levels.ALARM)
    since = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 0 and edge.level(HOLD_PIN) == 1)
    assert since.level(ENABLE_PIN) == 0
    while board.dropped is None:
        board.wait(0.01)
    assert board.dropped == "the motor controller raised its alarm"
    with pytest.raises(DeviceError, match=r"^The board must be cleared before a new motion, because the motor"):
        board.run(3, 1.0)


def test_a_silent_computer_loses_the_drive_line_within_a_tenth_of_a_second(
    emulated: EmulatedBoard, strict_board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    strict_board.run(3, 10.0)
    wait_for(emulated, strict_board, Levels.DRIVE)
    sent_s: list[float] = []
    link = strict_board
    send = link._send

    def muted(line: bytes) -> None:
        if not sent_s:
            sent_s.append(emulated.clock.now_s())

    monkeypatch.setattr(link, "_send", muted)
    since = len(emulated.edges)
    down = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 0, since=since)
    # The last message that was sent is one polling period older than the first message that was not sent.
    assert down.host_s - sent_s[0] <= 0.1
    assert emulated.wait_for(lambda edge: edge.level(ENABLE_PIN) == 0, since=since).cycle - down.cycle < HERTZ * TICK_S
    monkeypatch.setattr(link, "_send", send)
    while strict_board.dropped is None:
        strict_board.wait(0.01)
    assert strict_board.dropped == (
        "the board received no message from this program for 80 ms (is the computer overloaded?)"
    )


def test_a_silent_computer_loses_the_standing_motor_too_but_later(
    emulated: EmulatedBoard, strict_board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit is ten times that during motion: a motor at rest is no danger, and a computer may be delayed for a
    moment.
    """
    emulated.wait_for(lambda edge: edge.level(ENABLE_PIN) == 1)
    since, before_s = len(emulated.edges), emulated.clock.now_s()
    monkeypatch.setattr(strict_board, "_send", lambda line: None)
    after_s = emulated.clock.now_s()
    down = emulated.wait_for(lambda edge: edge.level(ENABLE_PIN) == 0, since=since)
    # The last message was sent up to one polling period before sending was blocked, or during the blocking.
    assert down.host_s - before_s >= 0.8 - 2 * ASK_EVERY_S
    assert down.host_s - after_s <= 0.8 + ASK_EVERY_S
    monkeypatch.undo()


def test_a_motion_that_takes_too_long_loses_the_drive_line(emulated: EmulatedBoard, board: Board) -> None:
    since = len(emulated.edges)
    board.run(3, 0.05)
    up = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 1, since=since)
    down = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 0, since=emulated.edges.index(up))
    assert (down.cycle - up.cycle) / HERTZ == pytest.approx(0.05, abs=2 * TICK_S)


def test_a_slow_motion_may_take_minutes(emulated: EmulatedBoard, board: Board) -> None:
    since = len(emulated.edges)
    board.run(3, 66.0)  # with 16 bits of milliseconds (65.536 s), 66.000 s would be taken as 0.464 s
    up = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 1, since=since)
    emulated.clock.wait_until(up.host_s + 0.6)
    assert emulated.edges[-1].level(DRIVE_PIN) == 1


def test_force_is_sampled_at_its_rate_without_loss_and_converted_rightly(emulated: EmulatedBoard, board: Board) -> None:
    emulated.say("adc 0 1234")
    # 1234 mV of 5000 mV, in 1024 steps.
    until(lambda: any(sample.level == 252 for sample in board.samples()))
    emulated.clock.wait_until(emulated.clock.now_s() + 1.0)
    samples = board.samples()
    assert board.lost_samples == 0
    assert {sample.level for sample in samples} == {252}
    steps_s = [b.board_s - a.board_s for a, b in pairwise(samples)]
    assert all(step_s == pytest.approx(5e-3, abs=INTERRUPT_S) for step_s in steps_s)


def test_the_clocks_are_joined(emulated: EmulatedBoard, board: Board) -> None:
    emulated.clock.wait_until(emulated.clock.now_s() + 1.0)
    since = len(emulated.edges)
    board.run(1, 1.0)
    drive = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 1, since=since)
    wait_for(emulated, board, Levels.DRIVE)
    assert board.driven_board_s is not None
    assert board.clock.host_at(board.driven_board_s) == pytest.approx(drive.host_s, abs=2e-3)
    assert board.clock.u_at(board.driven_board_s) <= 2e-3


@pytest.mark.slow
def test_corrupt_bytes_cost_single_samples_and_no_command(
    emulated: EmulatedBoard, controller: MotorController, board: Board
) -> None:
    emulated.say("spoil 997 211")
    codes = [3, 5, 6, 9, 10, 12]
    for code in codes:
        board.run(code, 2.0)
        wait_for(emulated, board, Levels.BUSY_SEEN)
        while Levels.BUSY in board.levels:
            board.wait(0.01)
        board.release()
        while Levels.DRIVE in board.levels:
            board.wait(0.01)
    until_s = emulated.clock.now_s() + 5.0
    while board.lost_samples == 0 and emulated.clock.now_s() < until_s:
        board.wait(0.01)
    emulated.say("spoil 0 0")
    assert controller.codes == codes  # no code twice, although answers were lost
    assert board.damaged_lines > 0
    assert 0 < board.lost_samples <= board.damaged_lines


def test_a_reset_in_the_middle_is_said_and_lets_go_of_every_line(emulated: EmulatedBoard, board: Board) -> None:
    board.run(3, 10.0)
    wait_for(emulated, board, Levels.DRIVE)
    emulated.say("reset")
    with pytest.raises(DeviceError) as raised:
        until_lost(board)
    assert str(raised.value) == (
        f"The board on {emulated.port} was reset during the run, by its button, its power supply or another program; "
        "all its lines are off: start again."
    )
    assert emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) is None, since=len(emulated.edges) - 5)


def test_a_pulled_cable_is_said_and_drops_the_drive_line(emulated: EmulatedBoard, strict_board: Board) -> None:
    strict_board.run(3, 10.0)
    wait_for(emulated, strict_board, Levels.DRIVE)
    since = len(emulated.edges)
    pulled_s = emulated.done_s(emulated.say("unplug"))
    down = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 0, since=since)
    assert down.host_s - pulled_s <= 0.1
    with pytest.raises(DeviceError, match=rf"^The board on {emulated.port} was lost \(.*\): check that its cable is"):
        until_lost(strict_board)


def test_two_programs_on_one_port(emulated: EmulatedBoard, board: Board) -> None:
    with pytest.raises(DeviceError) as raised:
        opened(emulated.settings(), emulated.clock)
    # The emulator also has the port open; for a real port, the process number is that of the other program.
    assert re.fullmatch(
        rf"The port {emulated.port} must be free, but another program \(process \d+\) has it open: "
        "close that program first.",
        str(raised.value),
    )
    board.wait(0.05)  # the connection of the first program still works


def test_another_firmware_is_refused(
    sketch: tuple[Path, Path], emulated: EmulatedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fingervision.testbed.board.wire.PROTOCOL", 2)
    with pytest.raises(DeviceError) as raised:
        opened(emulated.settings(), emulated.clock)
    assert str(raised.value) == (
        f"The board on {emulated.port} must speak protocol 2, but its firmware 1.0 speaks 1: upload the sketch of this "
        "fingervision (fingervision/testbed/firmware)."
    )


def test_an_unknown_port_is_answered_with_those_there_are(emulated: EmulatedBoard) -> None:
    settings = emulated.settings()
    with pytest.raises(
        DeviceError,
        match=r"^There is no serial port /dev/ttyACM99; (those of this machine are|this machine has none)",
    ):
        opened(type(settings)("/dev/ttyACM99", settings.lines), emulated.clock)
