"""An emulated Zaber device in the network, written from Zaber's "ASCII Protocol Manual": one axis with ramps and
scatter.

The device understands `get` and `set` of maxspeed and pos, `move abs`, `home`, `stop` and the request for its state. It
moves on the host's clock with a trapezoidal speed profile, and its encoder readings scatter.
"""

import contextlib
import random
import socket
import threading
from time import monotonic

SPEED_UNIT = 1.6384


class ZaberDevice:
    """Serves one connection at a time; `port` is HOST:PORT."""

    def __init__(
        self, microstep_mm: float, ramp_s: float = 0.03, strays_mm: float = 0.0, error_mm: float = 0.0
    ) -> None:
        self.microstep_mm, self.ramp_s = microstep_mm, ramp_s
        self.strays, self.error = strays_mm / microstep_mm, error_mm / microstep_mm
        self.maxspeed = round(2.0 / microstep_mm * SPEED_UNIT)
        self.from_steps, self.to_steps, self.began_s, self.ends_s = 0.0, 0.0, monotonic(), monotonic()
        self.heard: list[str] = []
        self.is_homed = True
        self._random = random.Random(3)
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = f"127.0.0.1:{self._socket.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def close(self) -> None:
        self._socket.close()

    def at_steps(self) -> float:
        """Present position, from a trapezoidal speed profile."""
        now_s = monotonic()
        if now_s >= self.ends_s:
            return self.to_steps
        whole_s, passed_s = self.ends_s - self.began_s, now_s - self.began_s
        ramp_s = min(self.ramp_s, 0.5 * whole_s)
        top = 1.0 / (whole_s - ramp_s)  # share of the distance per second at full speed
        if passed_s < ramp_s:
            done = 0.5 * top / ramp_s * passed_s**2
        elif passed_s < whole_s - ramp_s:
            done = top * (passed_s - 0.5 * ramp_s)
        else:
            done = 1.0 - 0.5 * top / ramp_s * (whole_s - passed_s) ** 2
        return self.from_steps + done * (self.to_steps - self.from_steps)

    def go(self, to_steps: float) -> None:
        now_s, at_steps = monotonic(), self.at_steps()
        way = abs(to_steps - at_steps)
        self.from_steps, self.to_steps, self.began_s = at_steps, to_steps, now_s
        self.ends_s = now_s + (way / (self.maxspeed / SPEED_UNIT) + self.ramp_s if way else 0.0)

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            with connection, contextlib.suppress(OSError):
                pending = b""
                while received := connection.recv(1024):
                    *lines, pending = (pending + received).split(b"\n")
                    for line in lines:
                        connection.sendall(self._answer(line.decode("ascii").strip()))

    def _answer(self, line: str) -> bytes:
        head, _, _ = line.removeprefix("/").partition(":")
        words = head.split()
        numbers, command = [], []
        for word in words:
            (command if command or not word.isdigit() or len(numbers) == 3 else numbers).append(word)
        device, axis = (int(each) for each in [*numbers, "0", "0"][:2])
        self.heard.append(" ".join(command))
        flag, data = self._do(command)
        state = "BUSY" if monotonic() < self.ends_s else "IDLE"
        identity = f" {numbers[2]}" if len(numbers) > 2 else ""
        reply = f"{device:02d} {axis}{identity} {flag} {state} -- {data}"
        checksum = -sum(reply.encode("ascii")) & 0xFF
        return f"@{reply}:{checksum:02X}\r\n".encode("ascii")

    def _do(self, command: list[str]) -> tuple[str, str]:
        match command:
            case []:
                return "OK", "0"
            case ["get", "maxspeed"]:
                return "OK", str(self.maxspeed)
            case ["set", "maxspeed", value]:
                self.maxspeed = int(float(value))
                return "OK", "0"
            case ["get", "pos"]:
                return "OK", str(round(self.at_steps() + self._random.uniform(-self.strays, self.strays)))
            case ["move", "abs", value] if not self.is_homed or abs(float(value)) * self.microstep_mm > 20.0:
                return "RJ", "BADDATA" if self.is_homed else "NOREF"
            case ["move", "abs", value]:
                self.go(float(value) + self.error)
                return "OK", "0"
            case ["home"]:
                self.is_homed = True
                self.go(0.0)
                return "OK", "0"
            case ["stop"]:
                self.from_steps = self.to_steps = self.at_steps()
                self.ends_s = monotonic()
                return "OK", "0"
            case _:
                return "RJ", "BADCOMMAND"
