"""One board object for all parts of a test bed that name the same board file."""

from fingervision.storage.board_toml import read_board
from fingervision.storage.toml_section import Section
from fingervision.testbed.board.board import Board, opened
from fingervision.testbed.build_context import BuildContext

KEY = "board"


def board_of(section: Section, context: BuildContext) -> Board:
    """Return the board named by the key `board` of a part's section; it is opened once.

    Raises
    ------
    DataError, DeviceError, InputFileError
        The board's settings are invalid, or the board cannot be opened.
    """
    path = context.folder / section.word(KEY)
    name = f"{KEY} {path.resolve()}"
    if name not in context.shared:
        context.shared[name] = opened(read_board(path), context.clock)
    board: Board = context.shared[name]
    return board.hold()
