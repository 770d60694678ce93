"""The file board.toml: port, wiring and time limits of a board.

schema = 1
port = "/dev/ttyACM0"
force_rate_hz = 200                      # 1000 / n, at most 250; 200 if not given
silence_ms = 80                          # time without a message after which the drive line drops; 10 to 95
settle_ms = 5                            # time from select lines to drive line; 0: at the same instant
[lines]
select = ["D2", "D3", "D4", "D5"]        # bit 0 first; on one port with drive: D2-D7, D8-D13 or A0-A5
drive = "D6"
enable = "D7"                            # servo on, if the controller needs it
hold = "D11"                             # optional; made active when the drive line drops
busy = "D8"
alarm = "D9"
in_position = "D10"                      # optional
force = "A0"                             # if there is a sensor; without select, drive, busy and alarm: a sensor only
active_low = ["busy", "alarm"]           # lines whose low level means true
"""

from pathlib import Path

from fingervision.domain.board_settings import NEEDED_TO_MOVE, SELECT, BoardSettings, Line, Role
from fingervision.storage.toml_section import Section, read_section

SCHEMA = 1
FASTEST_PERIOD_MS, SLOWEST_PERIOD_MS = 4, 250
# The drive line must be off within 100 ms after the last message; the board's clock may be slow by some per cent.
LONGEST_SILENCE_MS = 95
# Pins 0 and 1 are the serial line.
PORTS = (range(2, 8), range(8, 14), range(14, 20))
PINS = {f"D{number}": number for number in range(2, 14)} | {f"A{number}": 14 + number for number in range(6)}
_SINGLE = (Role.DRIVE, Role.ENABLE, Role.HOLD, Role.BUSY, Role.ALARM, Role.IN_POSITION, Role.FORCE)


def read_board(path: Path) -> BoardSettings:
    """Read a board's settings.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or a value in it is not allowed; the message names the line.
    """
    top = read_section(path, "board", ("port", "force_rate_hz", "silence_ms", "settle_ms", "lines"), SCHEMA)
    port = top.word("port")
    if not port:
        top.refuse("port", "must be the name of a serial port, such as /dev/ttyACM0 or COM3, but is empty.")
    return BoardSettings(
        port=port,
        lines=_lines(top.table("lines")),
        force_period_ms=_period_ms(top),
        silence_ms=top.whole("silence_ms", 80, low=10, high=LONGEST_SILENCE_MS),
        settle_ms=top.whole("settle_ms", 5, low=0, high=255),
    )


def _period_ms(top: Section) -> int:
    rate_hz = top.number("force_rate_hz", 200.0, low=1000.0 / SLOWEST_PERIOD_MS, high=1000.0 / FASTEST_PERIOD_MS)
    period_ms = round(1000.0 / rate_hz)
    if abs(period_ms * rate_hz - 1000.0) > 1e-6 * rate_hz:
        top.refuse(
            "force_rate_hz",
            f"must be 1000 divided by a whole number, but is {rate_hz:g}: {1000.0 / period_ms:.5g} is the nearest.",
        )
    return period_ms


def _lines(section: Section) -> dict[Role, Line]:
    names = [role.name.lower() for role in _SINGLE]
    section.only(("select", *names, "active_low"))
    pins = {
        role: _pin(section, name, section.word(name))
        for role, name in zip(_SINGLE, names, strict=True)
        if name in section.values
    }
    if "select" in section.values:
        raw = section.values["select"]
        if not isinstance(raw, list) or len(raw) != len(SELECT):
            section.refuse("select", f"must be a list of {len(SELECT)} pins, bit 0 first, but is {raw!r}.")
        pins |= {role: _pin(section, "select", word) for role, word in zip(SELECT, raw, strict=True)}
    low = section.values.get("active_low", [])
    if not isinstance(low, list) or not all(each in ("select", *names) for each in low):
        section.refuse("active_low", f"must be a list of lines ({', '.join(('select', *names))}), but is {low!r}.")
    lines = {role: Line(pin, _name(role) not in low) for role, pin in pins.items()}
    _check(section, lines)
    return lines


def _name(role: Role) -> str:
    return "select" if role in SELECT else role.name.lower()


def _pin(section: Section, key: str, word: object) -> int:
    if not isinstance(word, str) or word not in PINS:
        section.refuse(key, f"must be a pin D2 to D13 or A0 to A5, but is {word!r}.")
    return PINS[word]


def _check(section: Section, lines: dict[Role, Line]) -> None:
    taken: dict[int, Role] = {}
    for role, line in lines.items():
        if line.pin in taken:
            section.refuse(_name(role), f"must be another pin than {_name(taken[line.pin])}, but is the same.")
        taken[line.pin] = role
    if Role.FORCE in lines and lines[Role.FORCE].pin < PORTS[2].start:
        section.refuse("force", "must be an analogue pin, A0 to A5, but is a digital one.")
    missing = [_name(role) for role in NEEDED_TO_MOVE if role not in lines]
    if missing and (len(missing) < len(NEEDED_TO_MOVE) or Role.FORCE not in lines):
        section.refuse(None, f"must state {', '.join(dict.fromkeys(missing))}, without which no motor is driven.")
    used = {port for role in (*SELECT, Role.DRIVE) if role in lines for port in PORTS if lines[role].pin in port}
    if len(used) > 1:
        section.refuse(
            "drive",
            "must lie on one port with the select lines (D2-D7, D8-D13 or A0-A5), so that they change at once, but "
            "does not.",
        )
