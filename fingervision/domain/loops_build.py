"""Build of the C loops: all .c files of the package are joined into one source and compiled into one library.

The constants of a .c file are taken from the .py file of the same name, where each constant is stated once with its
reason, and from the files that the .c file names in lines `/* after NAME */`. This module uses only the standard
library, because an installation builds the loops before any dependency is installed.
"""

import ast
import hashlib
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import TypeGuard

PACKAGE = Path(__file__).resolve().parents[1]
# Where a source tree keeps the libraries that it builds for itself.
SOURCE_BUILD = PACKAGE.parent / "build" / "loops"
HEADER, DOOR = "domain/loops.h", "domain/loops.c"
PREPARE = re.compile(r"^PREPARE\((\w+)\)", re.MULTILINE)
LOOP = re.compile(r'^LOOP\((\w+), "(\w*)", "(\w*)"\)', re.MULTILINE)
# The compiler must not reorder sums, so that results are equal on all processors; only optimisations that change no
# digit are allowed.
FLAGS = ("-O3", "-std=c11", "-shared", "-fvisibility=hidden", "-fno-math-errno", "-ffp-contract=off", "-w")
# Platforms for which wheels are made on any machine, and what zig calls them. glibc 2.17 (manylinux2014) and macOS 11
# are no newer than those of the dependencies' wheels.
MACHINES = {
    "linux_x86_64": "x86_64-linux-gnu.2.17",
    "linux_aarch64": "aarch64-linux-gnu.2.17",
    "macosx_11_0_x86_64": "x86_64-macos.11.0",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
}
Number = int | float
Constant = Number | tuple["Constant", ...]


class CannotBuildError(RuntimeError):
    """There is no C compiler, or the compilation failed."""


def loop_files() -> list[Path]:
    """List the .c files with loops; each is beside the .py file that calls its loops."""
    return [path for path in sorted(PACKAGE.rglob("*.c")) if path != PACKAGE / DOOR]


def native_platform() -> str:
    """Platform tag of a library that is compiled here.

    A Python for two kinds of processor (universal2) compiles for the one that it runs on, and macOS 11 is asked for.
    """
    if sys.platform == "darwin":
        return f"macosx_11_0_{platform.machine()}"
    return re.sub(r"\W", "_", sysconfig.get_platform())


def library_name(machine: str | None = None) -> str:
    """File name of the library for the present sources; the same on all machines, apart from its suffix."""
    digest = hashlib.sha256(" ".join(FLAGS).encode())
    files = [PACKAGE / HEADER, PACKAGE / DOOR, Path(__file__)]
    for path in loop_files():
        files += [path, path.with_suffix(".py")] if path.with_suffix(".py").exists() else [path]
    for path in files:
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    is_windows = (machine or native_platform()).startswith("win")
    return f"_loops-{digest.hexdigest()[:16]}.{'pyd' if is_windows else 'abi3.so'}"


def build(target: Path, machine: str | None = None) -> None:
    """Compile all loops into one library.

    Parameters
    ----------
    target : Path
        Path of the library to create; the folder must exist.
    machine : str, optional
        One of `MACHINES`, for which zig compiles; by default this machine, with its own compiler.

    Raises
    ------
    CannotBuildError
        If there is no C compiler, or it failed.
    """
    command = compiler(machine)
    if command is None:
        msg = (
            "The loops in C are not built yet, and no C compiler was found (cc, gcc, clang, or the one that the "
            "variable CC names): install "
            "one, or `pip install ziglang`, which brings one, or install fingervision with pip, which builds them."
        )
        raise CannotBuildError(msg)
    with tempfile.TemporaryDirectory() as name:
        source = Path(name) / "loops.c"
        source.write_text(one_source(), encoding="utf-8")
        links = _links(command, machine or native_platform(), Path(name))
        # The library is built beside the target and then renamed, so that it appears complete: another process may
        # build it at the same time.
        made = Path(tempfile.mkdtemp(dir=target.parent)) / "made"
        try:
            _run([*command, *FLAGS, str(source), "-o", str(made), *links])
            made.replace(target)
        finally:
            shutil.rmtree(made.parent, ignore_errors=True)


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        msg = f"The C compiler ({shlex.join(command)}) failed on the loops in C:\n{done.stderr[-2000:]}"
        raise CannotBuildError(msg)


def compiler(machine: str | None = None) -> list[str] | None:
    """Command of a C compiler for a machine of `MACHINES`, or for this one; None if no compiler is installed."""
    if machine is None:
        chosen = shlex.split(os.environ.get("CC", ""))
        chosen = chosen or [found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))][:1]
        if chosen:
            one_processor = ["-arch", platform.machine(), "-mmacosx-version-min=11.0"]
            return [*chosen, *one_processor] if sys.platform == "darwin" else chosen
    if find_spec("ziglang") is None:
        return None
    name = MACHINES.get(machine or native_platform())
    # Without a target zig would use every instruction of the processor at hand.
    return [sys.executable, "-m", "ziglang", "cc", "-s", *(["-target", name] if name else ["-mcpu=baseline"])]


def _links(command: list[str], machine: str, folder: Path) -> list[str]:
    """Linker options by which the compiled loops find the functions of Python and of the C library."""
    if not machine.startswith("win"):
        return ["-fPIC", "-undefined", "dynamic_lookup"] if machine.startswith("mac") else ["-fPIC", "-lm"]
    if "ziglang" not in command:
        return [f"-L{Path(sys.base_prefix) / 'libs'}", "-lpython3"]
    # What a Python for Windows has in `libs`, made from the functions that are declared.
    names = re.findall(r"^FROM_PYTHON .*?\b(Py\w*_\w+)", (PACKAGE / DOOR).read_text(encoding="utf-8"), re.MULTILINE)
    lines = ["LIBRARY python3.dll", "EXPORTS", *(f"{name} DATA" if "PyExc" in name else name for name in names)]
    (folder / "python3.def").write_text("\n".join(lines), encoding="utf-8")
    files = ["-d", str(folder / "python3.def"), "-l", str(folder / "libpython3.a")]
    _run([*command[: command.index("cc")], "dlltool", "-m", "i386:x86-64", *files])
    return [f"-L{folder}", "-lpython3"]


def one_source() -> str:
    """Join all .c files into one C source, each with the constants of its .py file."""
    pieces, loops, done = [(PACKAGE / HEADER).read_text(encoding="utf-8")], [], set[Path]()
    prepared: list[str] = []
    waiting = loop_files()

    def add(path: Path) -> None:
        if path in done:
            return
        done.add(path)
        text = path.read_text(encoding="utf-8")
        values: dict[str, Constant] = {}
        for needed in re.findall(r"^/\* after (\w+) \*/", text, re.MULTILINE):
            add(path.with_name(f"{needed}.c"))
            values.update(_constants_beside(path.with_name(f"{needed}.c")))
        values.update(_constants_beside(path))
        used = {name: value for name, value in values.items() if re.search(rf"\b{name}(_COUNT)?\b", text)}
        pieces.append(f'#line 1 "{path.relative_to(PACKAGE).as_posix()}"\n{_defined(used)}{text}{_undefined(used)}')
        loops.extend(LOOP.findall(text))
        prepared.extend(PREPARE.findall(text))

    for path in waiting:
        add(path)
    table = " ".join(f'ENTRY({name}, "{takes}", "{gives}")' for name, takes, gives in loops)
    calls = "".join(f"{name}(); " for name in prepared)
    pieces.append(
        f"#define ALL_LOOPS {table}\n#define PREPARE_ALL {calls}\n{(PACKAGE / DOOR).read_text(encoding='utf-8')}"
    )
    return "\n".join(pieces)


def _constants_beside(path: Path) -> dict[str, Constant]:
    beside = path.with_suffix(".py")
    return constants(beside) if beside.exists() else {}


def constants(path: Path) -> dict[str, Constant]:
    """Read the constants of a .py file: numbers and tuples of numbers with NAMES IN CAPITALS, also imported ones."""
    found: dict[str, object] = {"range": range, "len": len}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fingervision."):
            names = [alias.name for alias in node.names if alias.name.isupper()]
            other = PACKAGE.parent.joinpath(*node.module.split(".")).with_suffix(".py")
            if names and other.exists():
                theirs = constants(other)
                found.update({name: theirs[name] for name in names if name in theirs})
        elif isinstance(node, ast.Assign):
            try:
                value = eval(compile(ast.Expression(node.value), str(path), "eval"), {"__builtins__": {}}, found)
            except (NameError, TypeError, AttributeError):
                continue  # no plain number
            for target in node.targets:
                names = [t.id for t in ast.walk(target) if isinstance(t, ast.Name)]
                found.update(zip(names, value, strict=True) if isinstance(target, ast.Tuple) else {names[0]: value})
    return {name: value for name, value in found.items() if name.isupper() and _is_constant(value)}


def _is_constant(value: object) -> TypeGuard[Constant]:
    if isinstance(value, tuple):
        return bool(value) and all(_is_constant(one) for one in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def _in_c(value: Constant) -> str:
    if isinstance(value, tuple):
        return f"{{{', '.join(_in_c(one) for one in value)}}}"
    return f"({value!r})" if value < 0 else repr(value)


def _defined(values: dict[str, Constant]) -> str:
    lines = []
    for name, value in values.items():
        if isinstance(value, tuple):
            lines.append(f"#define {name}_COUNT {len(value)}")
        lines.append(f"#define {name} {_in_c(value)}")
    return "".join(f"{line}\n" for line in lines) + "#line 1\n"


def _undefined(values: dict[str, Constant]) -> str:
    return "".join(f"#undef {name}\n#undef {name}_COUNT\n" for name in values)
