"""Make the folder that `--out` names; a refusal of the system becomes a sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fingervision.domain.errors import OutputError


@contextmanager
def out_folder(path: Path) -> Iterator[None]:
    """Make a folder, unless it is there, and take it for the cause of what the system refuses in the block.

    Raises
    ------
    FingervisionError
        It cannot be made or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except FileExistsError:
        raise OutputError(f"--out must be a folder, but {path} is a file: name another.") from None
    except OutputError:  # of a file in it, with its own sentence
        raise
    except OSError as error:
        raise OutputError(
            f"The folder {path} cannot be written ({error.strerror}): name another with --out."
        ) from error


def make_out_folder(path: Path) -> None:
    """Make it before a long work begins, which would be lost where it cannot be made."""
    with out_folder(path):
        pass


@contextmanager
def new_out_folder(path: Path) -> Iterator[None]:
    """Make it before the block's long work, and take it away again where that fails and leaves it empty."""
    was_there = path.exists()
    make_out_folder(path)
    try:
        yield
    except BaseException:
        if not was_there and not any(path.iterdir()):
            path.rmdir()
        raise
