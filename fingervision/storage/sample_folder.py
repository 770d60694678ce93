"""Location of the sample files: inside the installed package, or beside it in the source tree."""

from pathlib import Path

import fingervision
from fingervision.domain.errors import InstallationError

NAME = "sample_frames"


def sample_folder() -> Path:
    """Return the folder of the sample files.

    Raises
    ------
    InstallationError
        The installation does not contain the sample files.
    """
    package = Path(fingervision.__file__).parent
    for folder in (package / NAME, package.parent / NAME):
        if folder.is_dir():
            return folder
    raise InstallationError(
        f"The samples must lie in {package / NAME}, but are not there: install fingervision again from its wheel."
    )
