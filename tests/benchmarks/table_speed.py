"""Time to read foreign tables of a million rows: `python -m tests.benchmarks.table_speed [--rows N]`.

Printed are seconds of processor time of this process, median of three, and the rows that were read. MATLAB and Parquet
are read in a process of their own, whose time is added. Excel is measured with a tenth of the rows.
"""

import datetime as dt
import statistics
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from fingervision.tables.read import read_measured_table
from tests.benchmarks.frame import Namespace, benchmark, processor_s

REPEATS = 3


def tables(rows: int, folder: Path) -> Iterator[tuple[str, Path]]:
    """Make one table after the other."""
    import openpyxl
    import pyarrow as pa
    import pyarrow.parquet as pq
    from nptdms import ChannelObject, TdmsWriter
    from scipy.io import savemat

    time = np.arange(rows) / 1000.0
    inputs = np.sin(time / 10.0)
    gaps = 4.0 + 10.0 * inputs
    start = dt.datetime(2024, 5, 3, 10)

    def text(name: str, header: str, line: Callable[[int, float, float, float], str], encoding: str = "utf-8") -> Path:
        path = folder / name
        with path.open("w", encoding=encoding) as file:
            file.write(header + "\n")
            file.writelines(line(k, t, x, g) + "\n" for k, (t, x, g) in enumerate(zip(time, inputs, gaps, strict=True)))
        return path

    def with_holes(k: int, t: float, x: float, g: float) -> str:
        return f"{1e3 * t:.1f},{1e3 * x:.3f},{'NaN' if k % 1000 == 7 else f'{g:.6f}'},ok"

    def with_dates(_: int, t: float, x: float, g: float) -> str:
        return f"{(start + dt.timedelta(seconds=t)).strftime('%d.%m.%Y %H:%M:%S.%f')};{x:.6f};{g:.6f}"

    yield "own format", text("own.csv", "time_s,input_mm,gap_mm", lambda _, t, x, g: f"{t:.3f},{x:.6f},{g:.6f}")
    yield (
        "German CSV",
        text(
            "german.csv",
            "Zeit [ms];Weg [µm];Abstand [mm]",
            lambda _, t, x, g: f"{1e3 * t:.1f};{1e3 * x:.3f};{g:.6f}".replace(".", ","),
            "cp1252",
        ),
    )
    yield "gaps and words among it", text("holes.csv", "time [ms],position [um],gap [mm],status", with_holes)
    yield "dates", text("dates.csv", "timestamp;Weg [mm];Abstand [mm]", with_dates)
    vectors = {"time_s": time, "position_mm": inputs, "gap_mm": gaps}
    pq.write_table(pa.table(vectors), folder / "table.parquet")
    yield "Parquet", folder / "table.parquet"
    savemat(folder / "table.mat", vectors)
    yield "MATLAB", folder / "table.mat"
    with TdmsWriter(folder / "table.tdms") as writer:
        channels = (("Time", time, "s"), ("Position", inputs, "mm"), ("Gap", gaps, "mm"))
        writer.write_segment([ChannelObject("Log", name, v, {"unit_string": unit}) for name, v, unit in channels])
    yield "TDMS", folder / "table.tdms"
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("Log")
    sheet.append(["time (s)", "position (mm)", "gap (mm)"])
    for t, x, g in zip(time[: rows // 10].tolist(), inputs.tolist(), gaps.tolist(), strict=False):
        sheet.append([t, x, g])
    book.save(folder / "table.xlsx")
    yield "Excel, a tenth", folder / "table.xlsx"


@benchmark(rows=1_000_000)
def main(chosen: Namespace) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        for name, path in tables(chosen.rows, Path(folder)):
            spent = []
            for _ in range(REPEATS):
                before = processor_s()
                read = read_measured_table(path).gap_mm.size
                spent.append(processor_s() - before)
            print(f"{name:26} {read:9d} rows {statistics.median(spent):7.2f} s", flush=True)
            path.unlink()
