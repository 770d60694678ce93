"""Draw the manual's figures beside their scripts: `python docs/figures/make.py`. Each script has a `draw`."""

import importlib
import sys
from pathlib import Path

import matplotlib as mpl

HERE = Path(__file__).parent
SCRIPTS = sorted(path.stem for path in HERE.glob("*.py") if path.stem != "make")


def make(folder: Path = HERE) -> list[Path]:
    """Draw every figure as SVG, the same bytes each time with the same Matplotlib."""
    sys.path.insert(0, str(HERE))
    made = []
    for name in SCRIPTS:
        path = folder / f"{name}.svg"
        with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "path", "font.size": 9}):
            importlib.import_module(name).draw().savefig(path, metadata={"Date": None})
        made.append(path)
    return made


if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parents[1]))
    make()
