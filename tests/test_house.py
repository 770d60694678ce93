"""The house itself: the command line starts fast and light, and says what it is."""

import subprocess
import sys

import pytest


def test_help_imports_neither_opencv_nor_scipy() -> None:
    program = (
        "import sys\n"
        "from click.testing import CliRunner\n"
        "from fingervision.cli import cli\n"
        "assert CliRunner().invoke(cli, ['--help']).exit_code == 0\n"
        "heavy = {'cv2', 'scipy', 'skimage', 'matplotlib', 'av', 'numpy'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["mesure"], ["No such command 'mesure'", "'measure'"]),
        (["opening.mp4"], ["opening.mp4", "measure", "table"]),
        (["calibrate", "bor"], ["No such command 'bor'", "'bar'"]),
        (
            ["calibrate", "opening.mp4"],
            ["opening.mp4", "bar", "slot", "scale", "chessboard", "charuco", "response", "check"],
        ),
        (["batch", "opening.mp4"], ["opening.mp4", "measure", "diagnose"]),
    ],
    ids=" ".join,
)
def test_an_unknown_command_is_wrong_usage_and_is_told_which_there_are(given: list[str], said: list[str]) -> None:
    done = subprocess.run([sys.executable, "-m", "fingervision", *given], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert not [word for word in said if word not in done.stderr]
