"""More foreign tables: habits of programs and people, one by one; written by `make_foreign.py`.

Each was read wrongly, or was refused although its content is clear, before the reader was mended.
"""

import math
from collections.abc import Callable, Sequence
from decimal import Decimal

ROWS = range(24)
T = [f"{k // 10}.{k % 10}" for k in ROWS]
X = [f"{0.8 * math.sin(0.09 * k) + 0.61:.4f}" for k in ROWS]
GAP = [f"{4.0 + 7.7 * float(x):.4f}" for x in X]
UM_X, UM_GAP = ([f"{1000 * Decimal(cell):.1f}" for cell in cells] for cells in (X, GAP))
TRUTH = {"time_s": T, "input_mm": X, "gap_mm": GAP}
NAMES = "time (s),position (mm),gap (mm)"


def lines(between: str, *columns: Sequence[str], shape: str = "") -> list[str]:
    """Rows of columns."""
    return [shape.format(*row) if shape else between.join(row) for row in zip(*columns, strict=True)]


def clock(shape: str) -> list[str]:
    """Times from 13:24:07 on, with S for the seconds."""
    return [shape.replace("S", f"{7 + k // 10:02}.{k % 10}00") for k in ROWS]


def tried(case: Callable[..., object]) -> list[object]:
    """Give the tables, made by `make_foreign.Case`."""
    plain = lines(",", T, X, GAP)
    half = ["12:59:59", "01:00:00", "01:00:01"]

    def one(name: str, text: Sequence[str], **more: object) -> object:
        return case(name, "\n".join(text) + "\n", "measured", more.pop("truth", TRUTH), **more)

    def dated(name: str, head: str, shape: str) -> object:
        return one(name, [f"{head},position (mm),gap (mm)", *lines(",", clock(shape), X, GAP)])

    first = {"asks": "header_line", "states": ("header_line=1",)}
    return [
        one("pixels_are_no_length", [NAMES + ",left (px),right (px)", *(f"{line},{k}.5,{90 + k}.25" for k, line in enumerate(plain))]),
        one("lost_micro_sign", ["Zeit [s];Weg [?m];Abstand [?m]", *lines(";", T, UM_X, UM_GAP)], asks="units.input", states=("units.input=um", "units.gap=um")),
        one("power_of_ten_unit", ["time (s),position (10^-3 mm),gap (1/1000 mm)", *lines(",", T, UM_X, UM_GAP)]),
        one("second_table_swapped", [NAMES, *plain, "time (s),gap (mm),position (mm)", "0.1,9.9,0.1"], **first),
        one("second_table_in_um", [NAMES, *plain, "time (s),position (um),gap (mm)", "0.1,9.9,0.1"], **first),
        one("settings_above_names", ["rate,10,", "gain,0.5,", NAMES, *plain]),
        one("statistics_below", [NAMES, *plain, "Mean,0.7,7.9", "Std. dev.,0.1,0.9", "Max,1.4,9.9"]),
        one("r_row_names", ['"time_s" "input_mm" "gap_mm"', *(f'"{k + 1}" {line}' for k, line in enumerate(lines(" ", T, X, GAP)))]),
        one("line_end_in_name", ['"Time\n[s]","Stage\nposition [mm]","Gap\n[mm]"', *plain]),
        one("units_in_cells", ["time;position;gap", *lines("", T, X, GAP, shape="{}s;{} mm;{}mm")]),
        one("arduino_monitor", lines("", clock("13:24:S"), X, GAP, shape="{} -> pos_mm:{}\tgap_mm:{}")),
        one("instrument_overflow", [NAMES, *plain, "2.4,9.91E37,9.9E+37"]),
        one("filler_value", [NAMES, *plain, "2.4,-9999,4.5"], asks="missing", states=("missing=-9999",)),
        one("curved_apostrophe", ["Zeit (s);Weg (nm);Abstand (mm)", *lines(";", T, [f"{10**6 * Decimal(x):,.0f}".replace(",", "\u2019") for x in X], GAP)]),
        one("points_for_thousands", ["Zeit (ms);Weg (mm);Abstand (mm)", *(line.replace("_", ".") for line in lines(
            ";", [f"{100 * k:,}".replace(",", "_") for k in ROWS], [x.replace(".", ",") for x in X], [g.replace(".", ",") for g in GAP]))]),
        dated("unnamed_dates", "", "2026-11-23 13:24:S"),
        dated("month_as_word", "Date/Time", "23-Nov-2026 13:24:S"),
        dated("compact_dates", "time", "20261123T1324SZ"),
        dated("durations_with_days", "elapsed", "0 days 00:00:S000"),
        one("clock_of_twelve_hours", ["time,position (mm),gap (mm)", *lines(",", [f"{half[k // 10]}.{k % 10}00" for k in ROWS], X, GAP)]),
        one("printed_frame", ["+---+---+---+", "| time_s | input_mm | gap_mm |", "+---+---+---+", *lines("", T, X, GAP, shape="| {} | {} | {} |"), "+---+---+---+", "24 rows in set"]),
        one("named_by_quantity", ["time (s),5 mm,position (mm)", *lines(",", T, GAP, X)], asks="columns.gap", states=("columns.gap=5 mm", "units.gap=mm")),
        one("commanded_and_actual", ["time (s),Commanded (mm),Actual (mm),Opening (mm)", *lines(",", T, [f"{x}1" for x in X], X, GAP)], asks="columns.input", states=("columns.input=Actual (mm)",)),
    ]  # fmt: skip
