"""Write access to the live view: one browser page at a time may change settings, the others watch and may take over."""

from fingervision.domain.errors import StateError

HELD = "Another browser page controls this live view: press Take over to control it from here."


class Pen:
    """Administers which browser page may change settings; only the thread of the server uses it.

    The first browser page that sends a request has write access, until it closes or another page takes over.
    """

    def __init__(self) -> None:
        self._holder: object = None

    def may_write(self, page: object) -> bool:
        """Whether a browser page may change settings now."""
        return self._holder is None or self._holder is page

    def write(self, page: object) -> None:
        """Take the write access if no other browser page has it.

        Raises
        ------
        StateError
            Another page has write access.
        """
        if not self.may_write(page):
            raise StateError(HELD)
        self._holder = page

    def take(self, page: object) -> None:
        """Take the write access from whichever browser page has it."""
        self._holder = page

    def let_go(self, page: object) -> None:
        """Release the write access of a browser page."""
        if self._holder is page:
            self._holder = None
