"""Commands in the tests' own process."""

from click.testing import CliRunner

from fingervision.cli import cli


def printed(*words: object) -> str:
    """What a command prints that must end well; its error is raised."""
    done = CliRunner().invoke(cli, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output
