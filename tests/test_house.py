"""The house itself: the command line starts fast and light, and says what it is."""

import subprocess
import sys


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


def test_an_unknown_command_is_wrong_usage() -> None:
    done = subprocess.run([sys.executable, "-m", "fingervision", "mesure"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "No such command 'mesure'" in done.stderr
