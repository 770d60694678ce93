"""Reading of board.toml, the file with the wiring of the board."""

from pathlib import Path

import pytest

from fingervision.domain.board_settings import SELECT, Line, Role
from fingervision.domain.errors import DataError
from fingervision.storage.board_toml import read_board

GOOD = """schema = 1
port = "/dev/ttyACM0"
force_rate_hz = 100
[lines]
select = ["D8", "D9", "D10", "D11"]
drive = "D12"
busy = "D2"
alarm = "D3"
force = "A5"
active_low = ["busy", "select"]
"""


def test_a_wiring_is_read_as_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_text(GOOD, encoding="utf-8")
    board = read_board(path)
    assert board.lines == {
        **{role: Line(8 + bit, active_high=False) for bit, role in enumerate(SELECT)},
        Role.DRIVE: Line(12),
        Role.BUSY: Line(2, active_high=False),
        Role.ALARM: Line(3),
        Role.FORCE: Line(19),
    }
    assert (board.force_period_ms, board.silence_ms, board.settle_ms) == (10, 80, 5)


def test_a_force_sensor_alone_is_a_board_too(tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_text('schema = 1\nport = "COM3"\n[lines]\nforce = "A0"\n', encoding="utf-8")
    board = read_board(path)
    assert board.senses_force
    assert not board.moves


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"D12"', '"D7"',
         "drive in line 6 of {path} must lie on one port with the select lines (D2-D7, D8-D13 or A0-A5), so that they "
         "change at once, but does not."),
        ('"D12"', '"D11"', "select in line 5 of {path} must be another pin than drive, but is the same."),
        ('"D12"', '"D1"', "drive in line 6 of {path} must be a pin D2 to D13 or A0 to A5, but is 'D1'."),
        ('"D12"', "12", "drive in line 6 of {path} must be a text, but is 12."),
        ('busy = "D2"\n', "",
         "[lines] in line 4 of {path} must state busy, without which no motor is driven."),
        ('"D8", ', "",
         "select in line 5 of {path} must be a list of 4 pins, bit 0 first, but is ['D9', 'D10', 'D11']."),
        ('"A5"', '"D4"', "force in line 9 of {path} must be an analogue pin, A0 to A5, but is a digital one."),
        ('["busy", ', '["bsy", ',
         "active_low in line 10 of {path} must be a list of lines (select, drive, enable, hold, busy, alarm, "
         "in_position, force), but is ['bsy', 'select']."),
        ("force_rate_hz = 100", "force_rate_hz = 300",
         "force_rate_hz in line 3 of {path} must be between 4 and 250, but is 300."),
        ("force_rate_hz = 100", "force_rate_hz = 130",
         "force_rate_hz in line 3 of {path} must be 1000 divided by a whole number, but is 130: 125 is the nearest."),
        ("force_rate_hz = 100", "silence_ms = 500",
         "silence_ms in line 3 of {path} must be between 10 and 95, but is 500."),
    ],
)  # fmt: skip
def test_what_cannot_be_wired_is_said_in_a_sentence(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DataError) as raised:
        read_board(path)
    assert str(raised.value) == said.format(path=path)
