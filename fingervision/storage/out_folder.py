"""The folder named by `--out`: create it, and convert errors of the operating system to error messages."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fingervision.domain.errors import OutputError


@contextmanager
def out_folder(path: Path) -> Iterator[None]:
    """Create a folder if needed; system errors raised in the `with` block are converted to errors that name the folder.

    Raises
    ------
    OutputError
        The folder cannot be created or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except FileExistsError:
        raise OutputError(f"--out must be a folder, but {path} is a file: name another.") from None
    except OutputError:  # error of a file in the folder, which has its own message
        raise
    except OSError as error:
        raise OutputError(
            f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
        ) from error


def make_out_folder(path: Path) -> None:
    """Create the folder before a long computation, so that its result is not lost because of an unusable folder."""
    with out_folder(path):
        pass


@contextmanager
def new_out_folder(path: Path) -> Iterator[None]:
    """Create the folder before a long computation, and remove it if the computation fails and leaves it empty."""
    was_there = path.exists()
    make_out_folder(path)
    try:
        yield
    except BaseException:
        if not was_there and not any(path.iterdir()):
            path.rmdir()
        raise
