"""Hatch's build hooks: the loops in C become a library in the wheel, and the README a page of a package index."""

import os
import re
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

# A link or picture whose target is neither an address nor a heading of the page: a file of the source tree.
LINK_TO_FILE = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)\s]+)\)")

# Python has already written this file's bytecode beside it; a build leaves nothing in the source tree.
shutil.rmtree(Path(__file__).with_name("__pycache__"), ignore_errors=True)


def loops_build(root: str) -> ModuleType:
    """The package's own builder, without the package (its dependencies are not installed) and without bytecode."""
    path = Path(root) / "fingervision" / "domain" / "loops_build.py"
    module = ModuleType("loops_build")
    module.__file__ = str(path)
    exec(compile(path.read_bytes(), path, "exec"), module.__dict__)
    return module


def index_page(readme: str, repository: str | None, version: str) -> str:
    """The README where its neighbouring files are absent: links lead into the repository at the version's tag.

    Without the address of a repository, the words of a link remain and pictures go: a page without dead links.
    """

    def replaced(link: re.Match[str]) -> str:
        picture, words, path = link.groups()
        if not repository:
            return "" if picture else words
        return f"{picture}[{words}]({repository.rstrip('/')}/{'raw' if picture else 'blob'}/v{version}/{path})"

    return LINK_TO_FILE.sub(replaced, readme)


class LoopsHook(BuildHookInterface):
    """Builds the loops in C, for this machine or the one of `loops_build.MACHINES` that FINGERVISION_PLATFORM names."""

    def dependencies(self) -> list[str]:
        """A C compiler from the package index where the machine has none, or none for another kind of machine."""
        return [] if loops_build(self.root).compiler(os.environ.get("FINGERVISION_PLATFORM")) else ["ziglang"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build before the wheel is put together."""
        if self.target_name != "wheel":
            return
        builder = loops_build(self.root)
        if version == "editable":
            library = builder.SOURCE_BUILD / builder.native_platform() / builder.library_name()
            if not library.exists():
                library.parent.mkdir(parents=True, exist_ok=True)
                builder.build(library)
            return
        platform = os.environ.get("FINGERVISION_PLATFORM")
        # Always compiled anew: a library that the source tree built for itself may be of another compiler.
        library = Path(self.root) / "build" / "wheel" / builder.library_name(platform)
        library.parent.mkdir(parents=True, exist_ok=True)
        builder.build(library, platform)
        build_data["force_include"][str(library)] = f"fingervision/domain/{library.name}"
        build_data["pure_python"] = False
        # Only Python's stable interface is used: one library for every version from 3.11 on.
        build_data["tag"] = f"cp311-abi3-{platform or builder.native_platform()}"


class ReadmeHook(MetadataHookInterface):
    """Gives the README as a package index can show it."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the description."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        page = index_page(text, metadata.get("urls", {}).get("Repository"), metadata["version"])
        metadata["readme"] = {"content-type": "text/markdown", "text": page}
