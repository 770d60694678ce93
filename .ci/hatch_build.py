"""Hatch's build hook: the loops in C become a library in the wheel, or beside the sources that stay in place."""

import importlib.util
import sysconfig
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


def loops_build(root: str) -> ModuleType:
    """The package's own builder, without the package: nothing that it needs is installed yet."""
    path = Path(root) / "fingervision" / "domain" / "loops_build.py"
    spec = importlib.util.spec_from_file_location("loops_build", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class LoopsHook(BuildHookInterface):
    """Builds the loops in C."""

    def dependencies(self) -> list[str]:
        """A C compiler from the package index where the machine has none."""
        return [] if loops_build(self.root).compiler() else ["ziglang"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build before the wheel is put together."""
        if self.target_name != "wheel":
            return
        builder = loops_build(self.root)
        name = builder.library_name()
        folder = Path(self.root) / "fingervision" / "domain" / "__pycache__"
        folder.mkdir(exist_ok=True)
        if not (folder / name).exists():
            builder.build(folder / name)
        if version != "editable":
            build_data["force_include"][str(folder / name)] = f"fingervision/domain/{name}"
            build_data["pure_python"] = False
            # Only Python's stable interface is used: one library for every version from 3.11 on.
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"cp311-abi3-{platform}"
