"""`fingervision live`: every invalid input gives an error sentence before the live view starts."""

import socket
from pathlib import Path

import pytest
from click.testing import CliRunner

from calib.measured_scale import Calibration
from fingervision.cli import cli
from fingervision.domain.errors import ExitCode, FingervisionError
from fingervision.live.server import Page
from fingervision.live.session import Session
from fingervision.storage.calibration_json import write_calibration
from tests.commands import printed


def refused(*arguments: str | Path) -> FingervisionError:
    result = CliRunner().invoke(cli, ["live", *map(str, arguments)])
    assert isinstance(result.exception, FingervisionError), (result.output, result.exception)
    return result.exception


@pytest.mark.parametrize(
    ("arguments", "beginning"),
    [
        ((), "The source must be given, but is not"),
        (("nothing.mp4",), "There is no recording nothing.mp4"),
        (("nothing.mp4", "--beside", __file__), "There is no recording nothing.mp4"),
        (("simulated", "--beside", __file__), "--beside is for a recording, but the source is live"),
        (
            ("http://127.0.0.1:9/feed", "--px-per-mm", "34"),
            "The stream http://127.0.0.1:9/feed must answer",
        ),
        (
            ("rtsp://lab:secret@127.0.0.1:9/feed", "--px-per-mm", "34"),
            "The stream rtsp://lab:***@127.0.0.1:9/feed must answer",
        ),
        (("http://127.0.0.1:9/feed", "--size", "640x480"), "--size and --rate-hz are for cameras of this computer"),
        (("simulated", "--size", "wide"), "--size must be WxH in pixels, such as 640x480, but is 'wide'."),
        (("simulated", "--rate-hz", "0"), "--rate-hz must be between 1 and 1000, but is 0."),
        (("simulated", "--size", "10x10"), "--size of the simulated camera must be 320x240 to 4096x4096"),
        (
            ("simulated", "--exposure-ms", "8"),
            "--format, --exposure-ms, --gain, --focus and --white-balance-k are for cam",
        ),
        (("simulated", "--exposure-ms", "-8"), "--exposure-ms must be positive, but is -8."),
        (("simulated", "--format", "raw"), "--format must be four letters, such as YUYV or MJPG, but is 'raw'."),
        (("simulated", "--rate-hz", "0.1"), "--rate-hz must be between 1 and 1000, but is 0.1."),
        (("simulated", "--roi", "1,2"), "--roi must be four whole numbers X,Y,W,H in pixels"),
        (("simulated", "--roi", "600,0,100,100"), "The region must lie inside the frame of 640x480 pixels"),
        (("simulated", "--px-per-mm", "-3"), "--px-per-mm must be positive, but is -3."),
        (("simulated", "--below-tip-mm", "0"), "--below-tip-mm must be positive, but is 0."),
        (
            ("simulated", "--host", "192.0.2.1", "--port", "0", "--password-file", "password"),
            "--host must be an address of this machine, but is 192.0.2.1.",
        ),
        (
            ("simulated", "--host", "nowhere.invalid", "--password-file", "password"),
            "--host must be an address of this machine",
        ),
        (("simulated", "--host", "0.0.0.0"), "--host 0.0.0.0 lets other computers connect, which needs a password"),
        (
            ("simulated", "--password-file", "short"),
            "The password in short must have at least 12 characters, but has 3.",
        ),
        (("simulated", "--password-file", "missing"), "The password cannot be read from missing"),
        (("simulated", "--tls-cert", "password"), "TLS needs both --tls-cert and --tls-key"),
        (("simulated", "--tls-cert", "missing", "--tls-key", "missing"), "There is no file missing"),
        (("simulated", "--hide", "backlash"), "--hide and --allow-motion are for a test bed"),
        (("simulated", "--allow-motion"), "--hide and --allow-motion are for a test bed"),
        (("0", "--bed", "simulated"), "With --bed the test bed's own camera is the source, but 0 is named too"),
        (("--bed", "simulated", "--no-page"), "--bed cannot be combined with --no-page"),
        (("--bed", "missing.toml"), "missing.toml"),
        (("simulated", "--drive-offset-s", "1"), "--drive-offset-s needs a --drive."),
        (("simulated", "--drive", "missing.csv"), "missing.csv"),
        (("simulated", "--model", "missing.csv"), "missing.csv"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: tuple[str, ...], beginning: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("password").write_text("twelve letters")
    Path("short").write_text("abc")
    words = str(refused(*arguments))
    assert beginning in words if beginning.startswith("missing") else words.startswith(beginning)


@pytest.mark.skipif(not Path("/sys").is_dir() or Path("/dev/video7").exists(), reason="needs Linux without this camera")
def test_a_camera_that_is_not_there_is_named_with_those_that_are() -> None:
    assert str(refused("7", "--px-per-mm", "34")).startswith("There is no camera 7 (/dev/video7 does not exist; ")


def test_a_source_without_a_scale_needs_the_page(tmp_path: Path) -> None:
    error = refused("7", "--no-page")
    assert error.exit_code == ExitCode.WRONG_USAGE
    assert "Without the browser page the scale must be given" in str(error)


def test_a_port_in_use_is_said(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        words = str(refused("simulated", "--port", str(port), "--out", tmp_path))
    assert words.startswith(f"The page cannot be served at 127.0.0.1 port {port} (Address already in use)")


def test_a_calibration_of_another_frame_size_is_refused(tmp_path: Path) -> None:
    write_calibration(Calibration(34.0, 0.0, (), (1280, 720)), tmp_path / "calibration.json")
    words = str(refused("simulated", "--calibration", tmp_path / "calibration.json"))
    assert "1280" in words
    assert "640" in words


def test_the_list_says_where_to_begin_without_a_camera() -> None:
    listed = printed("live", "--list")
    assert "/dev/video" in listed or "`simulated`" in listed


@pytest.mark.parametrize(("host", "is_warned"), [("127.0.0.1", False), ("0.0.0.0", True)])
def test_a_page_beyond_this_machine_warns_of_plain_http(
    host: str, is_warned: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(Session, "say", lambda self, name, words: said.append(words))
    monkeypatch.setattr(Page, "serve", lambda self, ending: self._listening.close())
    monkeypatch.setattr(Session, "start", lambda self: None)
    monkeypatch.setattr(Session, "stop", lambda self: None)
    password = tmp_path / "password"
    password.write_text("twelve letters")
    options = ["--host", host, "--port", "0", "--out", str(tmp_path), "--password-file", str(password)]
    CliRunner().invoke(cli, ["live", "simulated", *options])
    assert any("plain HTTP" in words for words in said) is is_warned
