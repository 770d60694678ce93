"""What the board's firmware holds: the real sketch on an emulated ATmega328P, its client over a pseudo-terminal.

    PYTHONPATH=. python tests/benchmarks/board.py [--seconds 60] [--slower 1]

The host's clock goes with the emulated crystal (0.5 % fast beside it), so that a machine with other work, where the
emulator gets on slowly, tells the truth too; `--slower 4` is slow motion. Columns say what is measured, over what, what
it must be and what it is: force samples and their distances in board's time; the joined clock against the true time of
drive edges spread over the whole time; and the time from the last word of the computer to the drive line's fall, with
the client cut off while it drives.
"""

import argparse
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
from tests.testbed.emulated_board import WIRING, EmulatedBoard, MotorController, compiled, missing_tools, running

EDGES, SILENCES = 12, 5
DRIVE_PIN = WIRING[Role.DRIVE].pin


def stream(emulated: EmulatedBoard, seconds: float) -> None:
    """Stream force for a while, with a motion now and then, and compare all clocks."""
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
    """Error of the joined clock at a drive edge, and its stated uncertainty."""
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
    """Cut the computer off while it drives, and see when the drive line falls."""
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


def main() -> None:
    """Print what the firmware holds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--slower", type=int, default=1)
    options = parser.parse_args()
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


if __name__ == "__main__":
    main()
