"""Write access to the live view: one page at a time has it, and other pages only watch until they take it over."""

from fingervision.domain.errors import StateError

HELD = "Another page works this live view: press Take over to work it here."


class Pen:
    """Administers which page may change settings; used only by the thread of the server.

    The first page that sends a request has write access, until it closes or another page takes over.
    """

    def __init__(self) -> None:
        self._holder: object = None

    def may_write(self, page: object) -> bool:
        """Whether a page may change settings now."""
        return self._holder is None or self._holder is page

    def write(self, page: object) -> None:
        """Take write access if no other page has it.

        Raises
        ------
        StateError
            Another page has write access.
        """
        if not self.may_write(page):
            raise StateError(HELD)
        self._holder = page

    def take(self, page: object) -> None:
        """Take write access from whichever page has it."""
        self._holder = page

    def let_go(self, page: object) -> None:
        """Release the write access of a page."""
        if self._holder is page:
            self._holder = None
