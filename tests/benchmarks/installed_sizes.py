"""Size of what `pip install fingervision` puts on a disk, library by library.

    python tests/benchmarks/installed_sizes.py [--most-mb 600]

The base requirements of pyproject.toml and all that they require are followed through the metadata of the environment
it runs in, whatever else is installed there. Columns: megabytes of the files that a wheel brings; megabytes of byte
code that pip makes of them (0 with `pip install --no-compile`; Python makes of it what it uses); who asks for it.
"""

import argparse
import re
import tomllib
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
NAME, EXTRA = re.compile(r"[A-Za-z0-9._-]+"), re.compile(r"extra\s*==")
MB = 1e6


def required_by(requirements: list[str]) -> list[str]:
    """Names of what is required without any extra, on this machine."""
    found = []
    for requirement in requirements:
        words, _, marker = requirement.partition(";")
        if EXTRA.search(marker) or (marker and not _applies(marker)):
            continue
        name = NAME.match(words.strip())
        if name:
            found.append(re.sub(r"[-_.]+", "-", name[0]).lower())
    return found


def _applies(marker: str) -> bool:
    from packaging.markers import Marker

    return Marker(marker.strip()).evaluate()


def followed(names: list[str]) -> dict[str, set[str]]:
    """All that is needed, and by whom."""
    needed: dict[str, set[str]] = {name: {"fingervision"} for name in names}
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        try:
            more = required_by(distribution(name).requires or [])
        except PackageNotFoundError:
            continue
        for other in more:
            if other not in needed:
                waiting.append(other)
            needed.setdefault(other, set()).add(name)
    return needed


def size_mb(found: Distribution) -> tuple[float, float]:
    """Megabytes of files, and of byte code made of them."""
    own, byte_code = 0, 0
    seen = set()
    for file in found.files or []:
        path = Path(str(found.locate_file(file))).resolve()
        if path in seen or not path.is_file():
            continue
        seen.add(path)
        if path.suffix == ".pyc":
            byte_code += path.stat().st_size
        else:
            own += path.stat().st_size
    return own / MB, byte_code / MB


def own_mb() -> tuple[float, float]:
    """The project's own two packages, as a wheel holds them, and the library of its loops."""
    files = [path for part in ("fingervision", "calib") for path in (TOP / part).rglob("*") if path.is_file()]
    libraries = sorted((TOP / "build" / "loops").rglob("_loops-*"), key=lambda path: path.stat().st_mtime)
    own = [path for path in files if "__pycache__" not in path.parts] + libraries[-1:]
    return sum(path.stat().st_size for path in own) / MB, 0.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most-mb", type=float, default=600.0)
    most_mb = parser.parse_args().most_mb
    project = tomllib.loads((TOP / "pyproject.toml").read_text())["project"]
    rows = [("fingervision", *own_mb(), "")]
    missing = []
    for name, by in followed(required_by(project["dependencies"])).items():
        try:
            rows.append((name, *size_mb(distribution(name)), ", ".join(sorted(by))))
        except PackageNotFoundError:
            missing.append(name)
    rows.sort(key=lambda row: -row[1] - row[2])
    print(f"{'library':28}{'MB':>8}{'byte code':>11}   asked for by")
    for name, own, byte_code, by in rows:
        print(f"{name:28}{own:8.1f}{byte_code:11.1f}   {by}")
    total, byte_code = (sum(row[k] for row in rows) for k in (1, 2))
    print(f"{'in all':28}{total:8.1f}{byte_code:11.1f}")
    within = "within" if total <= most_mb else "beyond"
    print(f"\n{within} {most_mb:.0f} MB as wheels bring it; {total + byte_code:.0f} MB with all byte code")
    if missing:
        print(f"not installed here, and not counted: {', '.join(missing)}")


if __name__ == "__main__":
    main()
