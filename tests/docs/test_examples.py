"""Every example of the manual and of the README is run, in a copy of the samples, and prints what its page shows."""

import shutil
from pathlib import Path

import pytest

from tests.docs.examples import Block, agrees, blocks_of, check_options, commands_of, python_session, run_block

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path for path in (ROOT / "docs").rglob("*.md") if not {"_build", "_generated"} & set(path.relative_to(ROOT).parts)
)
# Pages that only define or explain have no example; those with examples that take less than a second or two.
QUICK: set[str] = {"docs/how_to/recipes.md"}
# Pages that show the same command as another: one run serves all of them.
TOGETHER = {
    "docs/tutorials/first_measurement.md": ["README.md", "docs/how_to/synchronise.md"],
    "docs/tutorials/phone_video.md": ["docs/how_to/light_lens_camera.md"],
}


def examples(path: Path) -> list[Block]:
    return [block for block in blocks_of(path, ROOT) if block.language in ("sh", "python", "toml")]


def with_examples() -> list[object]:
    elsewhere = {name for names in TOGETHER.values() for name in names}
    runs = [
        path
        for path in PAGES
        if any(block.is_run for block in examples(path)) and path.relative_to(ROOT).as_posix() not in elsewhere
    ]
    return [
        pytest.param(path, id=name, marks=() if name in QUICK else pytest.mark.slow)
        for path in runs
        for name in [path.relative_to(ROOT).as_posix()]
    ]


@pytest.mark.parametrize("page", with_examples())
def test_examples_run_and_print_what_the_page_shows(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(ROOT / "sample_frames", tmp_path / "sample_frames")
    monkeypatch.chdir(tmp_path)
    printed: dict[str, str] = {}
    with python_session():
        for path in (page, *(ROOT / name for name in TOGETHER.get(page.relative_to(ROOT).as_posix(), ()))):
            names: dict[str, object] = {"__name__": "example"}
            for block in examples(path):
                if block.is_run:
                    said = run_block(block, names, printed)
                    is_as_shown = not block.shown or agrees(block.shown, said)
                    assert is_as_shown, f"{block.place} shows another text than\n{said}"


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_line_has_a_command_and_options_that_exist(page: Path) -> None:
    for block in blocks_of(page, ROOT):
        if block.language == "sh":
            for command in commands_of(block):
                check_options(command)


def test_a_block_without_a_language_is_no_way_round() -> None:
    bare = [block.place for page in PAGES for block in blocks_of(page, ROOT) if block.language == ""]
    assert not bare, f"say sh, python, toml, text or console: {bare}"


def test_pages_have_examples() -> None:
    assert len(with_examples()) >= 8  # of some twenty pages
