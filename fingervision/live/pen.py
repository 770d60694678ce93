"""One page at a time works the live view; the others of the same user look on until they take over."""

from fingervision.domain.errors import StateError

HELD = "Another page works this live view: press Take over to work it here."


class Pen:
    """Who may change what; used by the server's one thread.

    The first page that asks for something has it, until it is gone or another takes it.
    """

    def __init__(self) -> None:
        self._holder: object = None

    def may_write(self, page: object) -> bool:
        """Whether a page may write now."""
        return self._holder is None or self._holder is page

    def write(self, page: object) -> None:
        """Take the pen where nobody has it.

        Raises
        ------
        FingervisionError
            Another page has it.
        """
        if not self.may_write(page):
            raise StateError(HELD)
        self._holder = page

    def take(self, page: object) -> None:
        """Take the pen, whoever has it."""
        self._holder = page

    def let_go(self, page: object) -> None:
        """Give it back."""
        if self._holder is page:
            self._holder = None
