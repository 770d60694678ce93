"""Tests of the board's firmware: the real sketch on an emulated ATmega328P, with its client on a pseudo-terminal.

    python -m tests.benchmarks.board [--seconds 60] [--slower 1]

The host's clock follows the emulated crystal (with a rate 0.5 % higher), so that results are valid on a loaded computer
too, on which the emulator is slow; `--slower 4` slows the emulation further. The program prints three results with
their required values: lost force samples and their intervals on the board's clock; the error of the converted clock at
edges of the drive line; and the time from the last message of the computer to the release of the drive line, if the
client is cut off during a motion.
"""

import resource
import sys
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

import numpy as np

from fingervision.domain.board_settings import Role
from fingervision.testbed.board.board import Board, opened
from fingervision.testbed.board.wire import Levels
from tests.benchmarks.frame import Namespace, benchmark
from tests.testbed.emulated_board import WIRING, EmulatedBoard, MotorController, compiled, missing_tools, running

EDGES, SILENCES = 12, 5
DRIVE_PIN = WIRING[Role.DRIVE].pin


def stream(emulated: EmulatedBoard, seconds: float) -> None:
    """Record force samples during several motions, and compare all clocks."""
    board = opened(emulated.settings(), emulated.clock).hold()
    samples, errors_s, uncertainties_s = list(board.samples()), [], []
    began_s, wall_s = emulated.clock.now_s(), monotonic()
    for number in range(1, EDGES + 1):
        emulated.clock.wait_until(began_s + seconds * number / (EDGES + 1))
        error_s, u_s = edge_error(emulated, board)
        errors_s.append(error_s)
        uncertainties_s.append(u_s)
        samples += board.samples()
    emulated.clock.wait_until(began_s + seconds)
    samples += board.samples()
    kept_up = (emulated.clock.now_s() - began_s) / (monotonic() - wall_s)
    distances_ms = 1e3 * np.array([b.board_s - a.board_s for a, b in pairwise(samples)])
    print(f"the emulator ran at {kept_up:.2f} of real time")
    print(
        f"force stream, {seconds:g} s: {len(samples)} samples, {board.lost_samples} lost (must be 0), "
        f"{board.damaged_lines} damaged lines, {distances_ms.min():.3f} to {distances_ms.max():.3f} ms apart"
    )
    errors_ms, u_ms = 1e3 * np.abs(errors_s), 1e3 * np.array(uncertainties_s)
    print(
        f"clocks, {EDGES} drive edges: error at most {errors_ms.max():.3f} ms (must be 2), median "
        f"{np.median(errors_ms):.3f} ms; stated u {u_ms.min():.3f} to {u_ms.max():.3f} ms"
    )
    board.close()


def edge_error(emulated: EmulatedBoard, board: Board) -> tuple[float, float]:
    """Error of the converted clock at an edge of the drive line, and its stated uncertainty."""
    since = len(emulated.edges)
    board.run(1, 1.0)
    while Levels.BUSY_SEEN not in board.levels or Levels.BUSY in board.levels:
        board.wait(0.01)
    board.release()
    edge = emulated.wait_for(lambda each: each.level(DRIVE_PIN) == 1, since=since)
    at_s = board.driven_board_s
    assert at_s is not None
    return board.clock.host_at(at_s) - edge.host_s, board.clock.u_at(at_s)


def silences(emulated: EmulatedBoard) -> None:
    """Cut the computer off during motions, and measure the time until the drive line is released."""
    falls_ms = []
    for _ in range(SILENCES):
        board = opened(emulated.settings(), emulated.clock).hold()
        board.run(1, 20.0)
        while Levels.DRIVE not in board.levels:
            board.wait(0.01)
        link = board._link
        send = link._send
        link._send = lambda line: None  # type: ignore[method-assign]
        last_s, since = link._last_asked_s, len(emulated.edges)
        fall = emulated.wait_for(lambda edge: edge.level(DRIVE_PIN) == 0, since=since)
        falls_ms.append(1e3 * (fall.host_s - last_s))
        link._send = send  # type: ignore[method-assign]
        board.close()
    print(
        f"silence, {SILENCES} times: drive line down {max(falls_ms):.1f} ms (must be 100) after the last word, at most"
    )


@benchmark(seconds=60.0, slower=1)
def main(options: Namespace) -> None:
    """Run all measurements, and print the results."""
    why = missing_tools()
    if why is not None:
        sys.exit(f"The emulated board {why}.")
    with TemporaryDirectory() as folder, running(compiled(Path(folder)), options.slower) as emulated:
        controller = MotorController(emulated, lambda code: 0.05)
        stream(emulated, options.seconds)
        controller.close()
    with TemporaryDirectory() as folder, running(compiled(Path(folder)), options.slower) as emulated:
        controller = MotorController(emulated, lambda code: 15.0)
        silences(emulated)
        controller.close()
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(f"client and measuring: {used.ru_utime + used.ru_stime:.1f} s of processor time")
