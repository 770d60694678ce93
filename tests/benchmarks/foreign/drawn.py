"""Tables as other programs write them, drawn from a seed, with their truth; shares nothing with the reader."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Values = NDArray[np.float64]
Cells = list[str]


@dataclass(frozen=True, eq=False)
class Drawn:
    """A table and what it holds (mm and s); rows that hold no measurement are absent from the truth.

    Parameters
    ----------
    what, name, text, kind : str
        Description, file name, content, and the kind as which it is read (`measured` or `drive`).
    time_s, input_mm : ndarray of float, shape (n,)
        Truth.
    gap_mm : ndarray of float, shape (n,), or None
        Truth of a measured table.
    """

    what: str
    name: str
    text: str
    kind: str
    time_s: Values
    input_mm: Values
    gap_mm: Values | None
    encoding: str = "utf-8"


@dataclass
class Motion:
    """A stroke of a stage with the gap that follows it."""

    rng: Generator
    least_mm: float = 0.03
    rows: int = 0
    time_s: Values = field(init=False)
    input_mm: Values = field(init=False)
    gap_mm: Values = field(init=False)

    def __post_init__(self) -> None:
        rng = self.rng
        rows = self.rows or int(rng.integers(60, 160))
        step = float(rng.choice([0.005, 0.01, 0.02, 0.04, 0.05, 0.1, 0.2]))
        stroke = float(np.exp(rng.uniform(np.log(max(self.least_mm, 0.8 * step)), np.log(3.0))))
        turns = rng.integers(1, 4)
        phase = np.linspace(0.0, turns, rows)
        shape = rng.choice(["sine", "triangle", "stairs"])
        half = 0.5 - 0.5 * np.cos(2.0 * np.pi * phase)
        if shape == "triangle":
            half = 1.0 - np.abs(2.0 * (phase % 1.0) - 1.0)
        elif shape == "stairs":
            half = np.round(half * 8.0) / 8.0
        self.time_s = step * np.arange(rows)
        self.input_mm = float(rng.choice([0.0, 0.0, 1.3, 5.2])) + stroke * half
        noise = rng.normal(0.0, 2e-4, rows)
        self.gap_mm = rng.uniform(0.1, 6.0) + rng.uniform(0.8, 12.0) * stroke * half + noise

    def table(self, what: str, name: str, lines: list[str], **of: object) -> Drawn:
        """Put lines beside the truth, which `of` may replace."""
        truth = {"kind": "measured", "time_s": self.time_s, "input_mm": self.input_mm, "gap_mm": self.gap_mm, **of}
        return Drawn(what, name, "\n".join(lines) + "\n", **truth)  # type: ignore[arg-type]


def cells(values: Values, digits: int, comma: bool = False, groups: str = "") -> Cells:
    """Print numbers with a fixed number of decimals."""
    out = [f"{value:,.{digits}f}" for value in values]
    return [cell.translate(str.maketrans({",": groups, ".": "," if comma else "."})) for cell in out]


def joined(columns: list[Cells], mark: str) -> list[str]:
    """Rows of the columns."""
    return [mark.join(row) for row in zip(*columns, strict=True)]


def rounded(values: Values, digits: int) -> Values:
    """The numbers as printed."""
    return np.round(values, digits)


def three_decimals(rng: Generator, number: int) -> Drawn:
    """Three decimals and a comma, in the layouts of LabVIEW and spreadsheets; a few with true thousands."""
    motion = Motion(rng)
    t, x, g = (rounded(v, 3) for v in (motion.time_s, motion.input_mm, motion.gap_mm))
    of = {"time_s": t, "input_mm": x, "gap_mm": g}
    words = [("Zeit", "Weg", "Abstand"), ("Time", "Position", "Gap"), ("Temps", "Course", "Ouverture"),
             ("Tempo", "Corsa", "Apertura")][rng.integers(4)]  # fmt: skip
    style = number % 8
    mark = str(rng.choice([";", "\t", "|"]))
    names = [f"{word} [{unit}]" for word, unit in zip(words, ("s", "mm", "mm"), strict=True)]
    three = [cells(v, 3, comma=True) for v in (t, x, g)]
    if style == 0:  # whole milliseconds beside it
        names[0], three[0] = f"{words[0]} [ms]", [str(round(1e3 * v)) for v in t]
    elif style == 1:  # dates beside it
        three[0] = [f"03.05.2024 12:{int(v) // 60:02}:{f'{v % 60:06.3f}'.replace('.', ',')}" for v in t]  # fmt: skip
        names[0] = words[0]
    elif style == 2:  # quoted between commas
        rows = joined([[f'"{cell}"' for cell in column] for column in three], ",")
        return motion.table("quoted commas", "table.csv", [",".join(names), *rows], **of)
    elif style == 3:
        rows = [f"t={a}s x={b}mm gap={c}mm" for a, b, c in zip(*three, strict=True)]
        return motion.table("names before numbers", "monitor.log", rows, **of)
    elif style == 4:
        head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,",
                "Multi_Headings\tNo", "X_Columns\tOne", "***End_of_Header***\t", "", "Channels\t2",
                "Y_Unit_Label\tmm\tmm", "X_Dimension\tTime\tTime", "***End_of_Header***\t\t",
                f"X_Value\t{words[1]}\t{words[2]}\tComment"]  # fmt: skip
        return motion.table("lvm with commas", "run.lvm", [*head, *joined(three, "\t")], **of)
    elif style == 5:  # a force beside it
        names.append("Kraft [N]")
        three.append(cells(rng.uniform(0.1, 4.0) + 0.2 * x, 3, comma=True))
    elif style == 6:  # true thousands: micrometres in English groups
        um = np.round(1e3 * (x + 1.2)), np.round(1e3 * (g + 1.0))
        columns = [cells(t, 3), *(cells(v, 0, groups=",") for v in um)]
        names = [f"{words[0]} [s]", f"{words[1]} [um]", f"{words[2]} [um]"]
        return motion.table("English thousands", "thousands.txt", ["\t".join(names), *joined(columns, "\t")],
                            time_s=t, input_mm=um[0] / 1e3, gap_mm=um[1] / 1e3)  # fmt: skip
    elif style == 7:  # no stroke below one: the commas alone tell nothing
        t, x, g = t + 1.0, x + 1.0, g + 1.0
        of = {"time_s": t, "input_mm": x, "gap_mm": g}
        three = [cells(v, 3, comma=True) for v in (t, x, g)]
    return motion.table(f"three decimals {style}", "table.txt", [mark.join(names), *joined(three, mark)], **of)


LENGTH_UNITS = {
    "m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "nm": 1e-6, "in": 25.4, "inch": 25.4, "mil": 0.0254, "dm": 100.0,
    "x10 um": 0.01, "x 10^-4 m": 0.1, "0.1 um": 1e-4, "1/100 mm": 0.01, "e-5 m": 0.01, "micron": 1e-3, "Å": 1e-7,
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "msec": 1e-3, "100 ms": 0.1}


def significant(values: Values, digits: int = 8) -> Cells:
    """Print with significant digits."""
    return [f"{value:.{digits}g}" for value in values]


def other_units(rng: Generator, number: int) -> Drawn:
    """Lengths and times in other units than mm and s, in the header, in a row, in no place at all, or wrong."""
    motion = Motion(rng)
    t, x, g = motion.time_s, motion.input_mm, motion.gap_mm
    of_x, of_g = (str(rng.choice(list(LENGTH_UNITS))) for _ in range(2))
    of_t = str(rng.choice(list(TIME_UNITS)))
    style = number % 10
    mark = str(rng.choice([";", "\t", ","]))
    columns = [
        significant(t / TIME_UNITS[of_t]),
        significant(x / LENGTH_UNITS[of_x]),
        significant(g / LENGTH_UNITS[of_g]),
    ]
    names = ["Time", "Stage position", "Gap"]
    left, right = [("[", "]"), ("(", ")"), (" in ", ""), ("/", "")][rng.integers(2 if " " in of_x + of_g + of_t else 4)]
    units = [of_t, of_x, of_g]
    if style < 4:
        head = [mark.join(f"{name}{left}{unit}{right}" for name, unit in zip(names, units, strict=True))]
        return motion.table(f"units {units} in names", "units.csv", [*head, *joined(columns, mark)])
    if style < 6:
        head = [mark.join(names), mark.join(units if style == 4 else [f"[{unit}]" for unit in units])]
        return motion.table(f"units {units} in a row", "units.csv", [*head, *joined(columns, mark)])
    plain = {"m": 1e3, "mm": 1.0, "um": 1e-3, "in": 25.4}
    own = str(rng.choice(list(plain)))
    bare = [significant(t), significant(x / plain[own]), significant(g / plain[own])]
    if style == 6:
        return motion.table(f"no units, {own}", "bare.csv", [mark.join(["Time (s)", *names[1:]]), *joined(bare, mark)])
    if style == 7:
        return motion.table(f"no names, {own}", "bare.csv", joined(bare, mark))
    if style == 8:
        head = mark.join(["Time (s)", "Position", "Gap"])
        with_unit = [bare[0], *([f"{c} {own}" for c in column] for column in bare[1:])]
        return motion.table(f"units in cells, {own}", "cells.csv", [head, *joined(with_unit, mark)])
    head = mark.join([f"Time ({of_t})", "Position (mm)", "Gap (mm)"])
    wrong = {"m": 1e3, "um": 1e-3}[str(rng.choice(["m", "um"]))]
    columns = [columns[0], significant(x / wrong), significant(g / wrong)]
    return motion.table(f"mm stated, {wrong} mm true", "wrong.csv", [head, *joined(columns, mark)])


def several_axes(rng: Generator, number: int) -> Drawn:
    """Stages of three axes, of which one moves the gripper."""
    motion = Motion(rng, least_mm=0.1)
    t, x, g = motion.time_s, rounded(motion.input_mm, 4), rounded(motion.gap_mm, 4)
    style = number % 8
    moving = int(rng.integers(3))
    forms = ["{} [mm]", "Pos {} [mm]", "Stage{}_mm", "{}-Achse (mm)", "Axis {} position (mm)", "Position {} (mm)",
             "pos_{}_mm", "{} position [mm]"]  # fmt: skip
    letters = [["X", "Y", "Z"], ["1", "2", "3"]][style == 4]
    names = [forms[style].format(letter) for letter in letters]
    parked = rng.uniform(-8.0, 8.0, 3)
    axes = [
        x if k == moving else rounded(parked[k] + rng.normal(0.0, 2e-4, t.size) * (rng.random() < 0.6), 4)
        for k in range(3)
    ]
    if number % 5 == 4:  # another axis creeps
        axes[(moving + 1) % 3] = rounded(axes[(moving + 1) % 3] + 0.01 * np.arange(t.size) / t.size, 4)
    columns = [cells(t, 3), *(cells(axis, 4) for axis in axes)]
    kind = "drive" if number % 3 == 0 else "measured"
    head = ["Time [s]", *names]
    if kind == "measured":
        columns.append(cells(g, 4))
        head.append("Gap [mm]")
    mark = str(rng.choice([",", ";", "\t"]))
    return motion.table(f"axis {letters[moving]} of {names[0]} moves", "stage.csv",
                        [mark.join(head), *joined(columns, mark)], kind=kind, input_mm=x,
                        gap_mm=g if kind == "measured" else None)  # fmt: skip


PAIRS = [
    ("Setpoint (mm)", "Actual (mm)"), ("Sollwert [mm]", "Istwert [mm]"), ("cmd_pos_mm", "enc_pos_mm"),
    ("Demand [mm]", "PV [mm]"), ("Target Position (mm)", "Current Position (mm)"), ("Stage.VAL (mm)", "Stage.RBV (mm)"),
    ("SP [mm]", "PV [mm]"), ("Reference (mm)", "Feedback (mm)"), ("Commanded Position (mm)", "Measured Position (mm)"),
    ("Führungsgröße w [mm]", "Regelgröße x [mm]"), ("Sollposition [mm]", "Position [mm]"),
    ("Position set (mm)", "Position get (mm)"), ("Consigne (mm)", "Mesure (mm)"), ("Target [mm]", "Readback [mm]"),
    ("Position command (mm)", "Position (mm)"), ("Setpoint position (mm)", "Encoder (mm)"),
]  # fmt: skip


def set_points(rng: Generator, number: int) -> Drawn:
    """A commanded position beside the one that was reached, which lags behind it."""
    motion = Motion(rng, least_mm=0.1)
    lag = int(rng.integers(1, 4))
    actual = rounded(np.concatenate([np.full(lag, motion.input_mm[0]), motion.input_mm[:-lag]])
                     + rng.normal(0.0, 3e-4, motion.time_s.size) + float(rng.choice([0.0, 0.02])), 4)  # fmt: skip
    gap = rounded(0.5 + 4.0 * (actual - actual.min()), 4)
    names = list(PAIRS[number % len(PAIRS)])
    columns = [cells(motion.input_mm, 4), cells(actual, 4)]
    if rng.random() < 0.4:
        names, columns = names[::-1], columns[::-1]
    kind = "drive" if number % 3 == 0 else "measured"
    head, rows = ["Time (s)", *names], [cells(motion.time_s, 3), *columns]
    if kind == "measured":
        head.append("Gap (mm)")
        rows.append(cells(gap, 4))
    mark = str(rng.choice([",", ";", "\t"]))
    return motion.table(f"{names}", "set.csv", [mark.join(head), *joined(rows, mark)], kind=kind, input_mm=actual,
                        gap_mm=gap if kind == "measured" else None)  # fmt: skip


def vendors(rng: Generator, number: int) -> Drawn:
    """Layouts of makers: Instron, Zwick, Keyence, Micro-Epsilon, PI, Rigol, Grafana, Origin."""
    motion = Motion(rng, least_mm=0.1)
    t, x, g = rounded(motion.time_s, 3), rounded(motion.input_mm, 4), rounded(motion.gap_mm, 4)
    of = {"time_s": t, "input_mm": x, "gap_mm": g}
    return VENDORS[number % len(VENDORS)](rng, motion, of)


def _instron(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    unit, size = [("mm", 1.0), ("in", 25.4)][rng.integers(2)]
    head = ['"Specimen label","Gripper 3"', f'"Rate 1","{rng.uniform(0.1, 2):.3f}","mm/min"', "",
            '"Time","Extension","Load","Gap"', f'"(s)","({unit})","(N)","({unit})"']  # fmt: skip
    force = cells(0.3 * x, 4)
    quoted = [[f'"{c}"' for c in col] for col in (cells(t, 4), cells(x / size, 6), force, cells(g / size, 6))]
    return motion.table(f"Instron {unit}", "bluehill.csv", [*head, *joined(quoted, ",")], **of)


def _zwick(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    um = rng.random() < 0.5
    head = ['"Prüfprotokoll testXpert II"', '"Probe";"Greifer 2"', '"Vorkraft";0,1;"N"', "",
            "Prüfzeit;Traversenweg;Standardkraft;Spaltweite", "s;mm;N;" + ("µm" if um else "mm")]  # fmt: skip
    columns = [cells(t, 3, comma=True), cells(x, 4, comma=True), cells(0.4 * x, 3, comma=True),
               cells(1e3 * g if um else g, 1 if um else 4, comma=True)]  # fmt: skip
    return motion.table("Zwick", "testxpert.csv", [*head, *joined(columns, ";")], encoding="cp1252", **of)


def _keyence(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    gap = [f"{value:+09.4f}" for value in g]
    lost = sorted(rng.choice(np.arange(5, t.size - 5), 3, replace=False).tolist())
    for row in lost:
        gap[row] = "-FFFFFFF"
    kept = np.delete(np.arange(t.size), lost)
    head = ["LK-Navigator 2", "Sampling cycle,1ms", "", "No.,Time(ms),Stage(mm),OUT1 Gap(mm)"]
    rows = joined([[str(k + 1) for k in range(t.size)], cells(1e3 * t, 0), cells(x, 4), gap], ",")
    return motion.table("Keyence", "lk.csv", [*head, *rows], **{name: value[kept] for name, value in of.items()})


def _micro_epsilon(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    head = ["ifmDAQTool 1.3", "Sensor: ILD1900-10", "", "Zeit [ms]\tWeg Tisch [µm]\tAbstand 1 [mm]\tIntensität [%]"]
    columns = [cells(1e3 * t, 1, comma=True), cells(1e3 * x, 1, comma=True), cells(g, 4, comma=True),
               cells(rng.uniform(40.0, 60.0, t.size), 1, comma=True)]  # fmt: skip
    return motion.table("Micro-Epsilon", "ild.txt", [*head, *joined(columns, "\t")], **of)


def _pi(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    head = ["# REM E-727 ", "#", "# VERSION = 1 ", "# TYPE = 1 ", "# SEPARATOR = 32 ", "# DIM = 3 ",
            f"# SAMPLE_TIME = {motion.time_s[1]:.6f} ", f"# NDATA = {t.size} ", "#",
            "# NAME0 = Time (s)", "# NAME1 = Actual Position of Axis 1 (um)", "# NAME2 = Gap (um)",
            "# END_HEADER"]  # fmt: skip
    columns = [cells(t, 4), cells(1e3 * x, 2), cells(1e3 * g, 2)]
    of = {**of, "input_mm": rounded(x, 5), "gap_mm": rounded(g, 5)}
    return motion.table("PI", "recorder.dat", [*head, *joined(columns, " ")], **of)


def _rigol(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    head = ["Time(s),CH1(V),CH2(V)", "# CH1 = stage position 1 V per mm, CH2 = gap 1 V per mm"]
    return motion.table("Rigol", "NewFile1.csv", [head[0], *joined([cells(t, 4), cells(x, 4), cells(g, 4)], ",")], **of)


def _grafana(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    if rng.random() < 0.5:
        start = 1_714_730_400_000
        stamps = [str(start + round(1e3 * v)) for v in t]
    else:
        stamps = [f"2024-05-03 10:{int(v) // 60:02}:{v % 60:06.3f}" for v in t]
    head = ['"sep=,"', '"Time","Stage position","Finger gap"'] if rng.random() < 0.5 else \
        ['"Time","Stage position","Finger gap"']  # fmt: skip
    rows = joined([stamps, [f"{c} mm" for c in cells(x, 4)], [f"{c} mm" for c in cells(g, 4)]], ",")
    return motion.table("Grafana", "Panel-data-2024-05-03.csv", [*head, *rows], **of)


def _origin(rng: Generator, motion: Motion, of: dict[str, Values]) -> Drawn:
    t, x, g = of.values()
    unit, size = [("mm", 1.0), ("µm", 1e-3)][rng.integers(2)]
    head = ["Long Name\tTime\tDisplacement\tGap", f"Units\ts\t{unit}\t{unit}", "Comments\t\tstage 2\tcamera"]
    rows = joined([[""] * t.size, cells(t, 3), cells(x / size, 4), cells(g / size, 4)], "\t")
    return motion.table(f"Origin {unit}", "Book1.txt", [*head, *rows], **of)


VENDORS: list[Callable[[Generator, Motion, dict[str, Values]], Drawn]] = [
    _instron, _zwick, _keyence, _micro_epsilon, _pi, _rigol, _grafana, _origin,
]  # fmt: skip


def clocks_and_losses(rng: Generator, number: int) -> Drawn:
    """Summer time, a counter's wrap, drop-outs of 0.000, rows of words: nothing of it may pass in silence."""
    motion = Motion(rng, least_mm=0.1, rows=120)
    t, x, g = rounded(motion.time_s, 3), rounded(motion.input_mm, 4), rounded(motion.gap_mm, 4)
    x, g = x + 0.5, g + 1.0
    of = {"time_s": t, "input_mm": x, "gap_mm": g}
    style = number % 5
    columns = [cells(t, 3), cells(x, 4), cells(g, 4)]
    head = "Time [s],Position [mm],Gap [mm]"
    if style == 0:  # the clock is put forward or back by an hour
        sign, at = int(rng.choice([-1, 1])), int(rng.integers(30, 90))
        clock = 2 * 3600.0 - t[at] + t + 3600.0 * sign * (np.arange(t.size) >= at)
        day = "2024-10-27" if sign < 0 else "2024-03-31"
        stamps = [f"{day} {int(c) // 3600:02}:{int(c) % 3600 // 60:02}:{c % 60:06.3f}" for c in clock]
        rows = joined([stamps, *columns[1:]], ",")
        return motion.table(f"summer time {sign:+}", "clock.csv", ["Timestamp,Position [mm],Gap [mm]", *rows], **of)
    if style == 1:  # a counter of milliseconds or microseconds overflows
        bits, unit, size = [(16, "ms", 1e3), (32, "us", 1e6)][rng.integers(2)]
        count = np.round(t * size).astype(np.int64) + 2**bits - round(size * t[int(rng.integers(20, 100))])
        stamps = [str(int(c) % 2**bits) for c in count]
        rows = joined([stamps, *columns[1:]], ",")
        return motion.table(f"wrap of {bits} bits", "counter.csv", [head.replace("[s]", f"[{unit}]"), *rows], **of)
    if style in (2, 3):  # 0.000 where nothing was measured
        lost = sorted(rng.choice(np.arange(3, 115), int(rng.integers(2, 7)), replace=False).tolist())
        place = 2 if style == 2 else 1
        for row in lost:
            columns[place][row] = "0.000"
        kept = np.delete(np.arange(t.size), lost)
        of = {name: value[kept] for name, value in of.items()}
        return motion.table(f"drop-outs in column {place + 1}", "lost.csv", [head, *joined(columns, ",")], **of)
    lost = sorted(rng.choice(np.arange(1, 119), int(rng.integers(12, 40)), replace=False).tolist())
    for row in lost:
        columns[2][row] = str(rng.choice(["ERR", "OVER", "----x"]))
    kept = np.delete(np.arange(t.size), lost)
    return motion.table("words for lost values", "words.csv", [head, *joined(columns, ",")],
                        **{name: value[kept] for name, value in of.items()})  # fmt: skip


CLASSES: dict[str, Callable[[Generator, int], Drawn]] = {
    "three decimals": three_decimals,
    "other units": other_units,
    "several axes": several_axes,
    "set-points": set_points,
    "vendors": vendors,
    "clocks and losses": clocks_and_losses,
}


def drawn(seed: int, each: int) -> list[tuple[str, Drawn]]:
    """Draw the tables of all classes, `each` of a class."""
    return [
        (label, draw(np.random.default_rng([seed, place, number]), number))
        for place, (label, draw) in enumerate(CLASSES.items())
        for number in range(each)
    ]
