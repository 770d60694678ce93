"""An emulated axis of an ESP300, written from Newport's manual: it moves at its speed on the host's clock."""

from time import monotonic
from typing import Any

from pymeasure.adapters import Adapter


class EmulatedEsp300(Adapter):
    """Responds as the controller does: no response to commands, one line in response to questions."""

    def __init__(self) -> None:
        super().__init__()
        self.from_mm = self.to_mm = 0.0
        self.speed_mm_s, self.began_s = 1.0, monotonic()
        self.errors: list[int] = []
        self.answers: list[str] = []
        self.closed = False

    def at_mm(self) -> float:
        way_mm = self.speed_mm_s * (monotonic() - self.began_s)
        left_mm = self.to_mm - self.from_mm
        if way_mm >= abs(left_mm):
            return self.to_mm
        return self.from_mm + (way_mm if left_mm > 0 else -way_mm)

    def _write(self, command: str, **_: Any) -> None:
        name, value = command.lstrip("123")[:2], command.lstrip("123")[2:]
        if command == "TE?":
            self.answers.append(str(self.errors.pop(0) if self.errors else 0))
        elif name == "SN":
            self.answers.append("2")
        elif name == "TP":
            self.answers.append(f"{self.at_mm():.7f}")
        elif name == "MD":
            self.answers.append("1" if self.at_mm() == self.to_mm else "0")
        elif name == "VA":
            self.speed_mm_s = float(value)
        elif name == "PA" and abs(float(value)) > 20.0:
            self.errors.append(106)
        elif name in ("PA", "OR"):
            self.from_mm, self.to_mm, self.began_s = self.at_mm(), float(value) if name == "PA" else 0.0, monotonic()
        elif name == "ST":
            self.from_mm = self.to_mm = self.at_mm()
        elif name != "MO":
            self.errors.append(6)

    def _read(self, **_: Any) -> str:
        return self.answers.pop(0)

    def close(self) -> None:
        self.closed = True
