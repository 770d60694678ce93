"""How long it takes to start: `import fingervision`, `import calib`, `fingervision --help`.

    python -m tests.benchmarks.start_up

Each is called several times in processes of their own; an empty Python is timed beside them and taken off the imports.
"""

import os
import statistics
import subprocess
import sys
import time

CALLS = 15
BARS_S = {"import fingervision": 0.05, "import calib": 0.05, "fingervision --help": 0.15}


def seconds(arguments: list[str]) -> tuple[float, float]:
    """Median wall time and median processor time of a process; the latter hardly depends on other programs."""
    wall, processor = [], []
    for _ in range(CALLS):
        began, before = time.perf_counter(), os.times()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        after = os.times()
        wall.append(time.perf_counter() - began)
        processor.append(sum(after[2:4]) - sum(before[2:4]))
    return statistics.median(wall), statistics.median(processor)


def main() -> None:
    """Print a line for each."""
    empty = seconds(["-c", "pass"])
    found = {
        "import fingervision": seconds(["-c", "import fingervision"]),
        "import calib": seconds(["-c", "import calib"]),
        "fingervision --help": seconds(["-m", "fingervision", "--help"]),
    }
    print(f"median of {CALLS} calls at load {os.getloadavg()[0]:.1f}; an empty Python takes {empty[0]:.3f} s")
    for what, taken in found.items():
        wall, processor = (a - b if "import" in what else a for a, b in zip(taken, empty, strict=True))
        print(f"{what:22} {wall:.3f} s, processor {processor:.3f} s   (bar {BARS_S[what]:.2f} s)")


if __name__ == "__main__":
    main()
