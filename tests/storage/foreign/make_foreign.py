"""Write the collection of foreign tables, each with its truth; `python -m tests.storage.foreign.make_foreign`.

Truth is calculated in decimal fractions from the numbers as they are printed, by code that shares nothing with the
product. `NAME.truth.csv` begins with `# kind:` and, where a decision is needed, `# asks:` (the key that the refusal must
name) and `# set:` (what is then stated); `# refused:` has words of the refusal of what cannot be decided by any key.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

from tests.storage.foreign.make_habits import tried

HERE = Path(__file__).parent
MM = {"mm": Decimal(1), "um": Decimal("0.001"), "m": Decimal(1000), "in": Decimal("25.4"), "mil": Decimal("0.0254"),
      "pm": Decimal("1e-9")}  # fmt: skip
S = {"s": Decimal(1), "ms": Decimal("0.001"), "min": Decimal(60)}
N = {"N": Decimal(1), "mN": Decimal("0.001")}
ROWS = 24


def motion(rows: int = ROWS, rate: float = 10.0, phase: float = 0.0) -> tuple[list[float], list[float], list[float]]:
    """Times in s, inputs in mm and gaps in mm of a run there and back."""
    time = [k / rate for k in range(rows)]
    inputs = [0.8 * math.sin(0.9 * t + phase) + 0.61 for t in time]
    gaps = [4.0 + 7.7 * x for x in inputs]
    return time, inputs, gaps


@dataclass
class Case:
    """A table and its truth."""

    name: str
    text: str
    kind: str
    columns: dict[str, list[str]] = field(default_factory=dict)
    encoding: str = "utf-8"
    asks: str = ""
    states: Sequence[str] = ()
    refused: str = ""


def printed(values: Iterable[float], unit: Decimal, places: int, mark: str = ".") -> tuple[list[str], list[str]]:
    """Numbers in a unit as they are printed, and what they mean in the project's own unit."""
    texts = [f"{value / float(unit):.{places}f}" for value in values]
    return [text.replace(".", mark) for text in texts], [str(Decimal(text) * unit) for text in texts]


def plain(
    name: str, header: str, between: str, units: tuple[str, str, str], places: tuple[int, int, int] = (3, 4, 4), *,
    mark: str = ".", kind: str = "measured", before: str = "", after: str = "", line: str = "\n",
    encoding: str = "utf-8", phase: float = 0.0, edit: Callable[[str], str] = str, rows: int = ROWS, rate: float = 10.0,
    roles: tuple[str, str, str] = ("time_s", "input_mm", "gap_mm"), **more: object,
) -> Case:  # fmt: skip
    """Give a table of time, input and gap."""
    data = motion(rows, rate, phase)
    factors = [S[units[0]], MM[units[1]], MM[units[2]]]
    columns = [printed(values, unit, p, mark) for values, unit, p in zip(data, factors, places, strict=True)]
    body = [between.join(edit(cell) for cell in row) for row in zip(*(texts for texts, _ in columns), strict=True)]
    text = before + line.join([*([header] if header else []), *body]) + line + after
    truth = dict(zip(roles, (values for _, values in columns), strict=True))
    return Case(name, text, kind, {role: truth[role] for role in roles if role}, encoding, **more)  # type: ignore[arg-type]


def cases() -> list[Case]:
    """All of them."""
    made = [
        plain("german_logger", "Zeit [ms];Weg [µm];Abstand [mm]", ";", ("ms", "um", "mm"), (0, 1, 4), mark=",", encoding="cp1252"),
        plain("german_excel", "Zeit (s);Position (mm);Öffnung (mm)", ";", ("s", "mm", "mm"), mark=",", encoding="utf-8-sig", phase=0.2, line="\r\n"),
        plain("excel_unicode_text", "Time (s)\tStage position (mm)\tGap (mm)", "\t", ("s", "mm", "mm"), encoding="utf-16", line="\r\n"),
        plain("utf16_without_mark", "time_s\tposition_um\tgap_um", "\t", ("s", "um", "um"), (3, 1, 1), encoding="utf-16-le"),
        plain("french_latin1", "Temps (s);Déplacement (µm);Écartement (mm)", ";", ("s", "um", "mm"), (3, 1, 4), mark=",", encoding="latin-1"),
        plain("spanish", "Tiempo [s];Posición [mm];Apertura [mm]", ";", ("s", "mm", "mm"), mark=",", phase=0.4),
        plain("italian", "Tempo (s);Spostamento (mm);Apertura (mm)", ";", ("s", "mm", "mm"), mark=",", encoding="cp1252", phase=0.5),
        plain("mac_line_ends", "time (ms),x (um),opening (um)", ",", ("ms", "um", "um"), (0, 1, 1), line="\r"),
        plain("inches", "Time (s),Encoder position (in),Gap (mil)", ",", ("s", "in", "mil"), (3, 5, 2)),
        plain("minutes", "Elapsed [min],Displacement [mm],Opening [mm]", ",", ("min", "mm", "mm"), (5, 4, 4), rate=2.0),
        plain("numpy_savetxt", "# t_s x_um gap_um", " ", ("s", "um", "um"), (3, 2, 2)),
        plain("gnuplot", "# time/s   position/mm   gap/mm", "   ", ("s", "mm", "mm")),
        plain("pipes", "time_ms | input_um | gap_um", " | ", ("ms", "um", "um"), (0, 1, 1)),
        plain("quoted", '"Time (s)","Position (mm)","Gap (mm)"', ",", ("s", "mm", "mm"), edit=lambda c: f'"{c}"'),
        plain("upper_case", "TIME_MS,INPUT_UM,GAP_UM", ",", ("ms", "um", "um"), (0, 1, 1)),
        plain("slash_units", "Zeit/ms\tWeg/µm\tSpalt/µm", "\t", ("ms", "um", "um"), (0, 1, 1), mark=",", encoding="cp1252"),
        plain("camel_case", "timeStamp [ms],stagePosition [um],fingerGap [um]", ",", ("ms", "um", "um"), (0, 1, 1)),
        plain("units_with_in", "Zeit in s;Position in µm;Abstand in mm", ";", ("s", "um", "mm"), (3, 1, 4), mark=","),
        plain("origin_units_row", "Time\tPosition\tGap\ns\tum\tmm", "\t", ("s", "um", "mm"), (3, 1, 4)),
        plain("unit_row_brackets", "Zeit;Weg;Abstand\n[s];[mm];[mm]", ";", ("s", "mm", "mm"), mark=","),
        plain("comsol_table", "% Time (s)              u_in (mm)               Gap (mm)", "  ", ("s", "mm", "mm"), (3, 6, 6),
              before="% Model:              gripper.mph\n% Version:            COMSOL 6.2.0.290\n% Date:               May 3 2024, 10:11\n% Table:              Table 1 - Gap\n"),
        plain("fortran_exponents", "  TIME(S)        X(MM)        GAP(MM)", "  ", ("s", "mm", "mm"), edit=lambda c: c + "D+00"),
        plain("unicode_minus", "time (s),position (mm),gap (mm)", ",", ("s", "mm", "mm"), phase=-1.6, edit=lambda c: c.replace("-", "\N{MINUS SIGN}")),
        plain("trailing_separators", "time [s];position [mm];gap [mm];", ";", ("s", "mm", "mm"), edit=str, line=";\n"),
        plain("blank_lines", "time [s],position [mm],gap [mm]\n", ",", ("s", "mm", "mm"), line="\n\n"),
        plain("shift_jis", "時刻 time [s],position [mm],gap [mm]".replace("時刻 ", ""), ",", ("s", "mm", "mm"), encoding="shift_jis", before="# 測定データ 計測\n"),
        plain("mojibake_micro", "time [s],position [Âµm],gap [mm]", ",", ("s", "um", "mm"), (3, 1, 4)),
        plain("greek_mu", "time [s],position [\u03bcm],gap [mm]", ",", ("s", "um", "mm"), (3, 1, 4)),
        plain("semicolon_comments", "time [s];position [mm];gap [mm]", ";", ("s", "mm", "mm"), before="# bench 3\n# operator: kh; stage: 2\n\n"),
        plain("no_separator_but_tabs_and_blanks", "time_s   input_um \tgap_um", " \t ", ("s", "um", "um"), (3, 1, 1)),
    ]  # fmt: skip
    made += simulations() + drives() + dates() + rows_left_out() + questions() + iso230() + instruments() + habits()
    return made + tried(Case)


def instruments() -> list[Case]:
    """Exports of measuring programs and controllers, each with what it writes above the numbers."""
    unit, fine = ("s", "mm", "mm"), ("ms", "mm", "mm")
    gcs = ["# REM PI GCS data array", "# VERSION = 1", "# SEPARATOR = 32", "# DIM = 3", "# SAMPLE_TIME = 0.1"]
    gcs += ["# NAME0 = Time (s)", "# NAME1 = Actual Position of Axis 1 (mm)", "# NAME2 = Gap (mm)", "# END_HEADER"]
    number = iter(range(1, ROWS + 1))
    numbered = plain("keyence_index", "No.,Time[ms],Position[mm],Gap[mm]", ",", fine, (0, 4, 4), rate=10.0)
    head, *body = numbered.text.splitlines()
    numbered.text = "LK-G5000,Ver 1.0\nDate,2024/05/03\nSampling,100 ms\n\n" + "\n".join(
        [head, *(f"{next(number)},{line}" for line in body)]
    )
    labels = "Long Name\tTime\tPosition\tGap\nUnits\ts\tmm\tmm\nComments\t\tstage\tcamera"
    origin = plain("origin_labels", "Time\tPosition\tGap", "\t", unit)
    origin.text = "\n".join([labels, *(f"\t{line}" for line in origin.text.splitlines()[1:])]) + "\n"
    bars = plain("markdown", "time (s) | position (mm) | gap (mm)", " | ", unit)
    head, *body = [f"| {line} |" for line in bars.text.splitlines()]
    bars.text = "\n".join([head, "|---|---|---|", *body]) + "\n"
    return [
        plain("pi_data_recorder", "\n".join(gcs), " ", unit),
        numbered,
        origin,
        bars,
        plain("catman", "Zeit [s]\tWeg [mm]\tAbstand [mm]\n1/10 Hz\t\t", "\t", unit, mark=",", before="HBM_CATMAN\nT0 = 03.05.2024 10:11:12\n\n", encoding="cp1252"),
        plain("instron", '"Time","Displacement","Gap"\n"(s)","(mm)","(mm)"', ",", unit, before='"Specimen","1"\n"Rate","0.5","mm/s"\n\n', edit=lambda c: f'"{c}"'),
        plain("laser_interferometer", "Time (s)\tPosition (mm)\tGap (mm)", "\t", unit, before="Agilent 5529A Dynamic Calibrator\nDate: 05/03/2024 Time: 10:11:12\nUnits: mm\n\n"),
        plain("excel_separator_line", "Time (s);Position (mm);Gap (mm)", ";", unit, before="sep=;\n"),
        plain("key_value_head", "t [s], x [mm], gap [mm]", ", ", unit, before="operator: kh\nrate: 10 Hz\n---\n"),
        plain("utf16_big_endian", "Time (s);Position (mm);Gap (mm)", ";", unit, encoding="utf-16-be"),
        plain("colon_units", "Time: s;Position: mm;Gap: mm", ";", unit, after=""),
        plain("metres_in_exponents", "Zeit/s\tWeg/m\tAbstand/m", "\t", ("s", "m", "m"), (3, 7, 7), mark=",", edit=lambda c: c + "E+00"),
        plain("dutch", "Tijd (s);Positie (mm);Afstand (mm)", ";", unit, mark=","),
        plain("portuguese", "Tempo (s);Deslocamento (mm);Abertura (mm)", ";", unit, mark=",", encoding="latin-1"),
        plain("slot_names", "Time (s),Dev1/ai0 position (mm),Dev1/ai1 gap (mm)", ",", unit, asks="columns.input",
              states=("columns.input=2", "columns.gap=3")),
    ]  # fmt: skip


def habits() -> list[Case]:
    """Habits of further programs and languages: labels, clocks, and units where other tables have none."""
    unit = ("s", "mm", "mm")
    number = iter(range(1, ROWS + 1))
    stamps = [f"05/23/2024 10:11:{12 + k // 10}:{100 * (k % 10):03d}" for k in range(ROWS)]
    logger = plain("keysight_daq", "Scan,Time,101 <Position> (MM),Alarm 101,102 <Gap> (MM),Alarm 102", ",", unit)
    head, *body = logger.text.splitlines()
    rows = [
        f"{next(number)},{stamp},{row.split(',')[1]},0,{row.split(',')[2]},0"
        for stamp, row in zip(stamps, body, strict=True)
    ]
    logger.text = "\n".join(["Instrument Name:,34972A", "Total Channels:,2", head, *rows]) + "\n"
    scope = plain("twincat_scope", "", "\t", unit, asks="units.time", states=("units.time=s",))
    pairs = [row.split("\t") for row in scope.text.splitlines()]
    scope.text = (
        "Name\tYT Scope\nFile\tC:\\scope.csv\n\nName\tActPos\tName\tGap\nData-Type\tREAL64\tData-Type\tREAL64\n"
    )
    scope.text += "SampleTime[ms]\t100\tSampleTime[ms]\t100\nUnit\tmm\tUnit\tmm\nOffset\t0\tOffset\t0\n\n"
    scope.text += "".join(f"{t}\t{x}\t{t}\t{g}\n" for t, x, g in pairs)
    turned = plain("exchanged_rows", "time [s],position [mm],gap [mm]", ",", unit, rows=40)
    turned.text = "".join(
        ",".join(cells) + "\n" for cells in zip(*(row.split(",") for row in turned.text.splitlines()), strict=True)
    )
    days = plain(
        "spreadsheet_days",
        "Date/Time,Position (mm),Gap (mm)",
        ",",
        ("s", "mm", "mm"),
        asks="units.time",
        states=("units.time=d",),
    )
    rows = days.text.splitlines()
    # 0.1 s are 1/864000 of a day: thirteen digits hold it to a nanosecond.
    days.text = (
        "\n".join(
            [
                rows[0],
                *(
                    f"{Decimal('45415.42') + Decimal(k) / 864000:.13f},{row.split(',', 1)[1]}"
                    for k, row in enumerate(rows[1:])
                ),
            ]
        )
        + "\n"
    )
    igor = "IGOR\nWAVES/D\ttime_s\tposition\tgap\nBEGIN\n"
    waves = plain("igor_text", "", "\t", unit, before=igor)
    waves.text += 'END\nX SetScale/P x 0,1,"", time_s; SetScale d 0,0,"mm", position,gap\n'
    segment = "Channels\t2\nSamples\t24\t\t24\nY_Unit_Label\tmm\t\tmm\nX_Dimension\tTime\t\tTime\nX0\t0.0\t\t0.0\nDelta_X\t0.1\t\t0.1\n"
    lvm = plain("labview_multi_x", "", "\t", unit)
    pairs = [row.split("\t") for row in lvm.text.splitlines()]
    lvm.text = (
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tMulti\n***End_of_Header***\t\n\t\n"
        + segment
    )
    lvm.text += "***End_of_Header***\t\t\nX_Value\tPosition\tX_Value\tGap\tComment\n" + "".join(
        f"{t}\t{x}\t{t}\t{g}\t\n" for t, x, g in pairs
    )
    pairs_log = plain(
        "key_value_rows", "", "\t", unit, asks="units", states=("units.time=s", "units.input=mm", "units.gap=mm")
    )
    pairs_log.text = "ready\n" + "".join(
        "t={} pos={} gap={}\n".format(*row.split("\t")) for row in pairs_log.text.splitlines()
    )
    unnamed_time = plain(
        "time_by_its_unit", "Čislo cas [s];Poloha [mm];Mezera [mm]".replace("Čislo cas", "Okamzik"), ";", unit, mark=","
    )
    return [
        logger, scope, turned, days, waves, lvm,
        pairs_log, unnamed_time,
        plain("types_row", "Time;Position;Gap\ns;mm;mm\nDT_DOUBLE;DT_DOUBLE;DT_DOUBLE", ";", unit, mark=","),
        plain("columns_in_comment", "# columns: time [s], position [mm], gap [mm]", ",", unit),
        plain("chinese", "时间 [s],位置 [mm],间隙 [mm]", ",", unit, encoding="gb18030"),
        plain("japanese", "時間[s],変位[㎜],ギャップ[㎜]", ",", unit, encoding="cp932"),
        plain("korean", "시간(s),변위(mm),간격(mm)", ",", unit, encoding="utf-8-sig"),
        plain("russian", "Время, \u0441;Положение, мм;Зазор, мм", ";", unit, mark=",", encoding="cp1251"),
        plain("polish", "Czas [s];Położenie [mm];Szczelina [mm]", ";", unit, mark=",", encoding="cp1250"),
        plain("matlab_durations", "Time,position_mm,gap_mm", ",", unit, edit=lambda c: c if len(c.split(".")[1]) > 3 else f"{c} sec"),
        plain("quoted_decimal_commas", '"Zeit [s]","Weg [mm]","Abstand [mm]"', ",", unit, mark=",", edit=lambda c: f'"{c}"'),
        plain("zwick", '"Prüfzeit";"Traversenweg";"Abstand"\n"s";"mm";"mm"', ";", unit, mark=",", encoding="cp1252"),
        plain("vibrometer", "Time\tVib Displacement\tGap\n[ s ]\t[ m ]\t[ mm ]", "\t", ("s", "m", "mm"), (9, 9, 6), before="Source File Name:\tscan.pvd\nPoints: 24\n"),
        plain("picometres", "Timestamp [s],Position Ch0 [pm],Gap [mm]", ",", ("s", "pm", "mm"), (3, 0, 4)),
        plain("modelica", '"time","stage.s","gripper.gap"', ",", unit, asks="columns.input",
              states=("columns.input=stage.s", "units.time=s", "units.input=mm", "units.gap=mm")),
        plain("command_and_feedback", "Time (sec),X Position Command (mm),X Position Feedback (mm)", ",", unit, kind="drive",
              roles=("time_s", "", "input_mm"), asks="columns.input", states=("columns.input=X Position Feedback (mm)",)),
    ]  # fmt: skip


def simulations() -> list[Case]:
    """Tables of programs that calculate."""
    _, inputs, gaps = motion(12)
    order = sorted(range(12), key=lambda k: inputs[k])
    x_m, in_mm = printed([inputs[k] for k in order], MM["m"], 7)
    gap_m, gap_mm = printed([gaps[k] for k in order], MM["m"], 6)
    x_mm, x_true = printed([inputs[k] for k in order], MM["mm"], 5)
    g_mm, g_true = printed([gaps[k] for k in order], MM["mm"], 5)
    half = [str(Decimal(g) / 2) for g in g_mm]
    truth = {"input_mm": x_true, "gap_mm": g_true}

    def rows(*columns: Sequence[str], between: str = ",") -> str:
        return "\n".join(between.join(row) for row in zip(*columns, strict=True)) + "\n"

    comsol = (
        '% Model,gripper.mph\n% Version,COMSOL 6.1.0.357\n% Date,"Mar 3 2024, 10:11"\n% Dimension,0\n% Length unit,m\n'
    )
    return [
        Case("comsol_csv_metres", comsol + "% u_in (m),Gap opening (m)\n" + rows(x_m, gap_m), "simulation", {"input_mm": in_mm, "gap_mm": gap_mm}),
        Case("comsol_displacement_u", comsol + "% u (m),Gap opening (mm)\n" + rows(x_m, g_mm), "simulation", {"input_mm": in_mm, "gap_mm": g_true}),
        Case("comsol_disp", "% Model: gripper.mph\n% Version: COMSOL 6.2\n% disp (mm)   Gap (mm)\n" + rows(x_mm, g_mm, between="   "), "simulation", truth),
        Case("prescribed_verschiebung", "Vorgegebene Verschiebung [m];Spalt [mm]\n" + rows(x_m, g_mm, between=";"), "simulation", {"input_mm": in_mm, "gap_mm": g_true}),
        Case("position_and_disp", "disp (mm),stage position (mm),gap (mm)\n" + rows(x_mm, x_mm, g_mm), "simulation", truth,
             asks="columns.input", states=("columns.input=stage position (mm)",)),
        Case("measured_u_is_no_input", "time_s,gap_mm,u (mm)\n" + rows([f"{0.1 * k:.1f}" for k in range(len(g_mm))], g_mm, ["0.0012"] * len(g_mm)), "measured", {}, refused="no column has a usual name for the input"),
        Case("ansys_workbench", "Displacement Stage [mm]\tGap [mm]\n" + rows(x_mm, g_mm, between="\t"), "simulation", truth),
        Case("simulink_sides", "input_mm;left (mm);right (mm)\n" + rows(x_mm, [f"-{h}" for h in half], half, between=";"), "simulation", truth),
        Case("several_models", "input_mm,simmechanics_mm,comsol_mm\n" + rows(x_mm, [f"{float(g) * 1.1:.5f}" for g in g_mm], g_mm), "simulation", truth,
             asks="columns.gap", states=("columns.gap=comsol_mm",)),
        Case("abaqus_report", "\n              X               GAP\n\n" + rows([f"   {x}" for x in x_mm], [f"      {g}" for g in g_mm], between="   "), "simulation", truth,
             asks="units.input", states=("units.input=mm", "units.gap=mm")),
        Case("comsol_expression", "% u_in (mm)   comp1.aveop1(2*v) (mm)\n" + rows(x_mm, g_mm, between="   "), "simulation", truth,
             asks="columns.gap", states=("columns.gap=2",)),
        Case("matlab_writematrix", rows(x_m, gap_m), "simulation", {"input_mm": in_mm, "gap_mm": gap_mm}, asks="columns.input",
             states=("columns.input=1", "columns.gap=2", "units.input=m", "units.gap=m")),
    ]  # fmt: skip


def drives() -> list[Case]:
    """Logs of stages."""
    time, inputs, gaps = motion(ROWS)
    t, t_true = printed(time, S["s"], 3)
    x, x_true = printed(inputs, MM["mm"], 4)
    um, um_true = printed(inputs, MM["um"], 1)
    force, force_true = printed([2.0 + g / 10.0 for g in gaps], N["mN"], 0)
    truth = {"time_s": t_true, "input_mm": x_true}
    comma = [[c.replace(".", ",") for c in cells] for cells in (t, um)]
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n"
        "Multi_Headings\tYes\nX_Columns\tOne\nTime_Pref\tRelative\nOperator\tkh\nDate\t2024/05/03\n"
        "Time\t10:11:12,3456789\n***End_of_Header***\t\n\t\n"
    )
    segment = (
        "Channels\t1\t\nSamples\t24\t\nDate\t2024/05/03\t\nTime\t10:11:12,34\t\nY_Unit_Label\tµm\t\n"
        "X_Dimension\tTime\t\nX0\t0,0000000000000000E+0\t\nDelta_X\t0,100000\t\n***End_of_Header***\t\t\n"
    )
    lvm = (
        head + segment + "X_Value\tPosition\tComment\n" + "".join(f"{a}\t{b}\t\n" for a, b in zip(*comma, strict=True))
    )
    none = head.replace("X_Columns\tOne", "X_Columns\tNo").replace("Decimal_Separator\t,", "Decimal_Separator\t.")
    lvm_no_x = none + segment.replace(",", ".") + "X_Value\tPosition\tComment\n" + "".join(f"\t{b}\n" for b in um)
    both = "".join(f"{a},{b},{f}\n" for a, b, f in zip(t, x, force, strict=True))
    two = "".join(f"{a};{b};{b}1\n" for a, b in zip(t, x, strict=True))
    grouped = [f"{float(c) * 1000:,.1f}" for c in um]
    grouped_true = [str(Decimal(c.replace(",", "")) * Decimal("0.000001")) for c in grouped]
    counts = [str(round(float(c) * 10)) for c in um]
    counts_true = [str(Decimal(c) * Decimal("0.0001")) for c in counts]
    return [
        Case("labview_one_x", lvm, "drive", {"time_s": t_true, "input_mm": um_true}, "cp1252"),
        Case("labview_no_x", lvm_no_x, "drive", {"time_s": [str(Decimal(k) / 10) for k in range(ROWS)], "input_mm": um_true}),
        Case("force_in_millinewton", "time (s),position (mm),force (mN)\n" + both, "drive", {**truth, "force_n": force_true}),
        Case("german_force", "Zeit (s);Weg (mm);Kraft (mN)\n" + both.replace(",", ";").replace(".", ","), "drive", {**truth, "force_n": force_true}),
        Case("command_and_encoder", "Zeit [s];Sollposition [mm];Istposition [mm]\n" + two, "drive",
             {"time_s": t_true, "input_mm": [f"{c}1" for c in x]}, asks="columns.input", states=("columns.input=Istposition [mm]",)),
        Case("same_name_twice", "time [s],position [mm],position [mm]\n" + "".join(f"{a},{b},{b}1\n" for a, b in zip(t, x, strict=True)), "drive",
             {"time_s": t_true, "input_mm": [f"{c}1" for c in x]}, asks="columns.input", states=("columns.input=3",)),
        Case("swiss_thousands", "Zeit (s);Weg (nm)\n" + "".join(f"{a};{b.replace(',', chr(39))}\n" for a, b in zip(t, grouped, strict=True)), "drive",
             {"time_s": t_true, "input_mm": grouped_true}),
        Case("english_thousands", "time (s),position (nm)\n" + "".join(f'{a},"{b}"\n' for a, b in zip(t, grouped, strict=True)), "drive",
             {"time_s": t_true, "input_mm": grouped_true}),
        Case("german_thousands", "Zeit (s);Weg (nm)\n" + "".join(
            f"{a.replace('.', ',')};{b.replace(',', '_').replace('.', ',').replace('_', '.')}\n" for a, b in zip(t, grouped, strict=True)), "drive",
             {"time_s": t_true, "input_mm": grouped_true}),
        Case("encoder_counts", "time [s],encoder [counts]\n" + "".join(f"{a},{b}\n" for a, b in zip(t, counts, strict=True)), "drive",
             {"time_s": t_true, "input_mm": counts_true}, asks="units.input", states=("units.input=0.1 um",)),
        Case("pandas_index", ",time_s,position_mm\n" + "".join(f"{k},{a},{b}\n" for k, (a, b) in enumerate(zip(t, x, strict=True))), "drive", truth),
        Case("one_row_repeated_in_time", "time [s],position [mm]\n" + "".join(f"{a},{b}\n" for a, b in zip([*t[:5], t[4], *t[5:]], [*x[:5], "9.0", *x[5:]], strict=True)),
             "drive", truth, asks="accept", states=("accept=repeated_time",)),
        Case("time_without_unit", "t,position_um\n" + "".join(f"{a},{b}\n" for a, b in zip(t, um, strict=True)), "drive",
             {"time_s": t_true, "input_mm": um_true}, asks="units.time", states=("units.time=s",)),
    ]  # fmt: skip


def dates() -> list[Case]:
    """Times as dates and clocks."""
    _, inputs, _ = motion(ROWS)
    x, x_true = printed(inputs, MM["mm"], 4)

    def case(
        name: str, header: str, stamps: Sequence[str], seconds: Sequence[Decimal], between: str = ",", **more: object
    ) -> Case:
        body = "".join(f"{a}{between}{b}\n" for a, b in zip(stamps, x, strict=True))
        truth = {"time_s": [str(s - seconds[0]) for s in seconds], "input_mm": x_true}
        return Case(name, header + "\n" + body, "drive", truth, **more)  # type: ignore[arg-type]

    tenths = [Decimal(k) / 10 for k in range(ROWS)]
    clock = [f"10:11:{5 + int(s):02d}.{int(s * 10) % 10}" for s in tenths]
    midnight = [
        f"23:59:{58 + k // 10:02d}.{k % 10}" if k < 20 else f"00:00:{k // 10 - 2:02d}.{k % 10}" for k in range(ROWS)
    ]
    hours = [Decimal(7200 * k) for k in range(ROWS)]
    days = [(3 + (2 * k) // 24, (2 * k) % 24) for k in range(ROWS)]
    noon = [Decimal(600 * k) for k in range(ROWS)]
    half = [(9 * 60 + 10 * k) for k in range(ROWS)]
    return [
        case("iso_8601", "timestamp,position [mm]", [f"2024-05-03T{c}+02:00" for c in clock], tenths),
        case("iso_8601_comma", "Zeitstempel;Weg [mm]", [f"2024-05-03 {c}".replace(".", ",") for c in clock], tenths, ";"),
        case("german_date", "Datum Uhrzeit;Weg [mm]".replace("Datum ", ""), [f"03.05.2024 {c}" for c in clock], tenths, ";"),
        case("date_and_clock_apart", "Datum\tUhrzeit\tWeg [mm]", [f"03.05.2024\t{c}" for c in clock], tenths, "\t"),
        case("clock_past_midnight", "clock,position [mm]", midnight, tenths),
        case("before_1970", "time,position [mm]", [f"1969-12-31 {c}" for c in clock], tenths),
        case("before_1900", "time,position [mm]", [f"1899-12-31 {c}" for c in clock], tenths),
        case("american_half_days", "Time,Position (mm)", [f"5/3/2024 {(m // 60 - 1) % 12 + 1}:{m % 60:02d}:00 {'AM' if m < 720 else 'PM'}" for m in half], noon),
        case("unix_seconds", "timestamp [s],position [mm]", [f"{Decimal('1714730400.5') + s}" for s in tenths], tenths),
        case("unix_milliseconds", "timestamp [ms],position [mm]", [f"{1714730400500 + 100 * k}" for k in range(ROWS)], tenths),
        case("labview_seconds_since_1904", "time [s],position [mm]", [f"{Decimal('3797577600.25') + s}" for s in tenths], tenths),
        case("day_and_month_open", "time,position [mm]", [f"0{d}/05/2024 {h:02d}:00" for d, h in days], hours, asks="date_order", states=("date_order=dmy",)),
        case("day_and_month_clear", "time,position [mm]", [f"{d + 20}/05/2024 {h:02d}:00" for d, h in days], hours),
    ]  # fmt: skip


def rows_left_out() -> list[Case]:
    """Rows that are no rows."""
    base = plain("x", "time [s],position [mm],gap [mm]", ",", ("s", "mm", "mm"))
    lines, truth = base.text.splitlines(), base.columns
    header = lines[0]

    def without(*rows: int) -> dict[str, list[str]]:
        return {name: [v for k, v in enumerate(values) if k not in rows] for name, values in truth.items()}

    def cell(row: int, place: int, words: str) -> str:
        cells = lines[row + 1].split(",")
        cells[place] = words
        return ",".join(cells)

    repeated = [*lines[:9], header, *lines[9:]]
    comments = [*lines[:4], "# pause", *lines[4:9], "% again", *lines[9:]]
    missing = [
        header,
        *(
            cell(3, 1, "NaN")
            if k == 3
            else cell(7, 1, "#N/A")
            if k == 7
            else cell(9, 1, "--")
            if k == 9
            else lines[k + 1]
            for k in range(ROWS)
        ),
    ]
    word = [header, *(cell(5, 1, "ERR") if k == 5 else lines[k + 1] for k in range(ROWS))]
    restart = [header, *lines[1:13], *[cell(k + 12, 0, f"{k / 10:.3f}") for k in range(12)]]
    times = [f"{k / 10:.3f}" for k in range(12)] * 2
    back = [header, *lines[1:13], cell(12, 0, "0.55"), *lines[14:]]
    sorted_rows = sorted(range(ROWS), key=lambda k: 0.55 if k == 12 else k / 10)
    sorted_truth = {
        name: [("0.55" if name == "time_s" and k == 12 else values[k]) for k in sorted_rows]
        for name, values in truth.items()
    }
    runs = {**truth, "time_s": times, "run": ["1"] * 12 + ["2"] * 12}

    def text(rows: Sequence[str]) -> str:
        return "\n".join(rows) + "\n"

    return [
        Case("repeated_header", text(repeated), "measured", truth),
        Case("comments_between", text(comments), "measured", truth),
        Case("words_for_missing", text(missing), "measured", without(3, 7, 9)),
        Case("logger_error", text(word), "measured", without(5)),
        Case("cut_off_line", text(lines)[:-8], "measured", without(ROWS - 1)),
        Case("zeros_at_the_end", text(lines) + "\x00" * 300, "measured", truth),
        Case("footer", text([*lines, "", "end of measurement"]), "measured", truth),
        Case("time_restarts", text(restart), "measured", runs, asks="runs=restart", states=("runs=restart",)),
        Case("time_backwards", text(back), "measured", sorted_truth, asks="backward_time", states=("accept=backward_time",)),
    ]  # fmt: skip


def questions() -> list[Case]:
    """Tables that cannot be right as they stand, or can be read in two ways."""
    slow = plain("milliseconds_called_seconds", "time [s],position [mm],gap [mm]", ",", ("ms", "mm", "mm"), (0, 4, 4), rate=0.5,
                 asks="units.time", states=("units.time=ms",))  # fmt: skip
    time, truth = printed([2.0 * k for k in range(ROWS)], S["ms"], 0)
    slow.columns["time_s"] = truth
    slow.text = "time [s],position [mm],gap [mm]\n" + "".join(
        f"{a},{row.split(',', 1)[1]}\n" for a, row in zip(time, slow.text.splitlines()[1:], strict=True)
    )
    metres = plain(
        "metres_called_millimetres",
        "time [s],input [mm],gap [mm]",
        ",",
        ("s", "m", "mm"),
        (3, 7, 4),
        asks="units.input",
        states=("units.input=m",),
    )
    microns = plain(
        "micrometres_called_millimetres",
        "time [s],input [mm],gap [mm]",
        ",",
        ("s", "um", "mm"),
        (3, 1, 4),
        asks="units.input",
        states=("units.input=um",),
    )
    open_mark = plain("comma_of_two_meanings", "Zeit [ms]\tWeg [mm]\tAbstand [mm]", "\t", ("ms", "mm", "mm"), (0, 3, 3), mark=",", phase=0.0,
                      asks="decimal", states=("decimal=,",))  # fmt: skip
    keep = [
        k
        for k, line in enumerate(open_mark.text.splitlines()[1:])
        if all(c[0] in "123456789" and c[1] == "," for c in line.split("\t")[1:2])
    ]
    rows = open_mark.text.splitlines()
    open_mark.text = "\n".join([rows[0], *(rows[k + 1] for k in keep)]) + "\n"
    open_mark.columns = {name: [values[k] for k in keep] for name, values in open_mark.columns.items()}
    constant = "time [s],position [mm]\n" + "".join(f"{k / 10},1.25\n" for k in range(ROWS))
    georgian = plain("georgian", "დრო [s],მდებარეობა [mm],ღრეჩო [mm]", ",", ("s", "mm", "mm"), asks="columns.input",
                     states=("columns.time=დრო [s]", "columns.input=მდებარეობა [mm]", "columns.gap=ღრეჩო [mm]"))  # fmt: skip
    nameless = plain("no_header", "", "\t", ("s", "mm", "mm"), asks="columns.input",
                     states=("columns.time=1", "columns.input=2", "columns.gap=3", "units.time=s", "units.input=mm", "units.gap=mm"))  # fmt: skip
    volts = plain(
        "piezo_voltage",
        "time [s],input [V],gap [mm]",
        ",",
        ("s", "um", "mm"),
        (3, 2, 4),
        asks="units.input",
        states=("units.input=1 um",),
    )
    commas = "Zeit [s],Weg [mm]\n" + "".join(f"{k // 10},{k % 10}0,{k // 7},{k % 7}5\n" for k in range(ROWS))
    return [
        slow, metres, microns, open_mark, georgian, nameless, volts,
        Case("constant_input", constant, "drive", {"time_s": [str(Decimal(k) / 10) for k in range(ROWS)], "input_mm": ["1.25"] * ROWS},
             asks="accept", states=("accept=constant_input",)),
        Case("commas_for_everything", commas, "drive", refused="semicolons"),
        Case("a_letter", "Dear colleague,\nplease find the data attached.\n\nBest wishes\n", "measured", refused="two numbers"),
    ]  # fmt: skip


def iso230() -> list[Case]:
    """Targets by cycles, from both sides."""
    targets = [Decimal(k) / 2 for k in range(5)]
    up = {(t, c): Decimal(round(1000 * math.sin(float(t)) + 100 * c)) / 1000 for t in targets for c in (1, 2)}
    down = {key: value + Decimal("1.5") for key, value in up.items()}
    rows: list[tuple[Decimal, int, int]] = []
    for c in (1, 2):
        rows += [(t, 1, c) for t in targets] + [(t, -1, c) for t in reversed(targets)]
    um = Decimal("0.001")
    gap = [t + um * (up if side > 0 else down)[t, c] for t, side, c in rows]
    truth = {"input_mm": [str(t) for t, _, _ in rows], "gap_mm": [str(g) for g in gap]}

    def german(value: Decimal) -> str:
        return str(value).replace(".", ",")

    matrix = "Sollposition [mm];1↑ [µm];1↓ [µm];2↑ [µm];2↓ [µm]\n" + "".join(
        ";".join(german(v) for v in (t, up[t, 1], down[t, 1], up[t, 2], down[t, 2])) + "\n" for t in targets
    )
    long_form = "Target (mm),Direction,Cycle,Position (mm)\n" + "".join(
        f"{t},{'up' if side > 0 else 'down'},{c},{t + um * (up if side > 0 else down)[t, c]}\n" for t, side, c in rows
    )
    french = "Cible (mm);Sens;Cycle;Position (µm)\n" + "".join(
        f"{german(t)};{'aller' if side > 0 else 'retour'};{c};{german((t + um * (up if side > 0 else down)[t, c]) / um)}\n"
        for t, side, c in rows
    )
    words = "Target [mm]\tforward 1 deviation [um]\tbackward 1 deviation [um]\tforward 2 deviation [um]\tbackward 2 deviation [um]\n" + "".join(
        "\t".join(str(v) for v in (t, up[t, 1], down[t, 1], up[t, 2], down[t, 2])) + "\n" for t in targets
    )  # fmt: skip
    return [
        Case("iso_230_german_matrix", matrix, "iso", truth),
        Case("iso_230_long_form", long_form, "iso", truth),
        Case("iso_230_french", french, "iso", truth, "cp1252"),
        Case("iso_230_words", words, "iso", truth),
    ]


def main() -> None:
    """Write all tables and truths beside this file."""
    for case in cases():
        suffix = (
            ".lvm"
            if case.name.startswith("labview_") and "X_Value" in case.text
            else ".csv"
            if "," in case.text
            else ".txt"
        )
        (HERE / f"{case.name}{suffix}").write_bytes(case.text.encode(case.encoding))
        lines = [f"# kind: {case.kind}", f"# file: {case.name}{suffix}"]
        lines += [f"# {key}: {words}" for key, words in (("asks", case.asks), ("refused", case.refused)) if words]
        lines += [f"# set: {words}" for words in case.states]
        if case.columns:
            lines.append(",".join(case.columns))
            lines += [",".join(row) for row in zip(*case.columns.values(), strict=True)]
        (HERE / f"{case.name}.truth.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
