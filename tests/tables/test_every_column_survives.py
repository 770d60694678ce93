"""A table with every column of the contract is read alike from every container that a lab saves it in."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.measured_table import MeasuredTable
from fingervision.tables.read import read_measured_table, read_simulation_table

ROWS = 30
SAME = {"rtol": 1e-12, "atol": 1e-9}


def contract() -> dict[str, list[str]]:
    """Columns as they are printed."""
    rng = np.random.default_rng(5)
    time = np.arange(ROWS) / 10.0
    inputs = 0.5 * np.sin(2.0 * time) + 0.6
    numbers = {
        "time_s": time,
        "input_mm": inputs,
        "gap_mm": 4.0 + 7.7 * inputs,
        "u_gap_mm": 0.002 + 0.001 * rng.random(ROWS),
        "u_random_mm": 0.001 + 0.001 * rng.random(ROWS),
        "left_mm": -2.0 - 3.85 * inputs,
        "right_mm": 2.0 + 3.85 * inputs + 0.001,
        "force_n": 3.0 * inputs,
        "link_2.x_mm": 2.0 + 0.4 * inputs,
        "u_link_2.x_mm": 0.0005 + 0.0001 * rng.random(ROWS),
        "hinge_1.angle_mrad": 40.0 * inputs,
        "u_hinge_1.angle_mrad": 0.05 + 0.01 * rng.random(ROWS),
    }
    texts = {name: [f"{value:.6f}" for value in values] for name, values in numbers.items()}
    texts["run"] = ["a" if k < ROWS // 2 else "b" for k in range(ROWS)]
    texts["link_2.x_mm"][4] = texts["u_link_2.x_mm"][4] = ""
    return texts


def own(path: Path, texts: dict[str, list[str]]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(texts)
        writer.writerows(zip(*texts.values(), strict=True))
    return path


def typed(texts: dict[str, list[str]]) -> list[list[object]]:
    columns = [
        list(cells) if name == "run" else [float(cell) if cell else None for cell in cells]
        for name, cells in texts.items()
    ]
    return [list(row) for row in zip(*columns, strict=True)]


def german_excel(folder: Path, texts: dict[str, list[str]]) -> Path:
    rows = [list(texts), *zip(*texts.values(), strict=True)]
    lines = [";".join(cell.replace(".", ",") if k else cell for cell in row) for k, row in enumerate(rows)]
    path = folder / "german.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="cp1252", newline="")
    return path


def unicode_tabs(folder: Path, texts: dict[str, list[str]]) -> Path:
    rows = [list(texts), *zip(*texts.values(), strict=True)]
    path = folder / "unicode.txt"
    path.write_text("\r\n".join("\t".join(row) for row in rows) + "\r\n", encoding="utf-16", newline="")
    return path


def units_row(folder: Path, texts: dict[str, list[str]]) -> Path:
    names = [name if name == "run" else name.rsplit("_", 1)[0] for name in texts]
    units = ["" if name == "run" else name.rsplit("_", 1)[1] for name in texts]
    rows = [names, units, *zip(*texts.values(), strict=True)]
    path = folder / "units.txt"
    path.write_text("\n".join("\t".join(row) for row in rows) + "\n", encoding="utf-8")
    return path


def micrometres_in_brackets(folder: Path, texts: dict[str, list[str]]) -> Path:
    names = {"time_s": "Zeit [s]", "input_mm": "Weg [mm]", "gap_mm": "Abstand [mm]", "force_n": "Kraft [N]",
             "link_2.x_mm": "link 2.x [µm]", "u_link_2.x_mm": "u_link 2.x [µm]",
             "hinge_1.angle_mrad": "hinge 1.angle [rad]", "u_hinge_1.angle_mrad": "u_hinge 1.angle [rad]"}  # fmt: skip
    shift = {"link_2.x_mm": 3, "u_link_2.x_mm": 3, "hinge_1.angle_mrad": -3, "u_hinge_1.angle_mrad": -3}
    columns = [
        [names.get(name, name), *(f"{cell}e{shift[name]}" if name in shift and cell else cell for cell in cells)]
        for name, cells in texts.items()
    ]
    path = folder / "brackets.csv"
    path.write_text("\n".join(";".join(row) for row in zip(*columns, strict=True)) + "\n", encoding="utf-8")
    return path


def workbook(folder: Path, texts: dict[str, list[str]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [list(texts), *typed(texts)]:
        book.active.append(row)
    book.save(folder / "book.xlsx")
    return folder / "book.xlsx"


def parquet(folder: Path, texts: dict[str, list[str]]) -> Path:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    columns = dict(zip(texts, map(list, zip(*typed(texts), strict=True)), strict=True))
    pq.write_table(pa.table(columns), folder / "table.parquet")
    return folder / "table.parquet"


def matlab(folder: Path, texts: dict[str, list[str]]) -> Path:
    from scipy.io import savemat

    columns = dict(zip(texts, map(list, zip(*typed(texts), strict=True)), strict=True))
    numbers = {
        name.replace(".", "_"): np.array([np.nan if v is None else v for v in values], dtype=np.float64)
        for name, values in columns.items()
        if name != "run"
    }
    savemat(folder / "table.mat", {"log": {**numbers, "run": [1.0 if v == "a" else 2.0 for v in columns["run"]]}})
    return folder / "table.mat"


def tdms(folder: Path, texts: dict[str, list[str]]) -> Path:
    nptdms = pytest.importorskip("nptdms")
    columns = dict(zip(texts, map(list, zip(*typed(texts), strict=True)), strict=True))
    channels = [
        nptdms.ChannelObject("Log", name, np.array([np.nan if v is None else v for v in values], dtype=np.float64))
        for name, values in columns.items()
        if name != "run"
    ]
    channels.append(nptdms.ChannelObject("Log", "run", columns["run"]))
    with nptdms.TdmsWriter(folder / "table.tdms") as writer:
        writer.write_segment(channels)
    return folder / "table.tdms"


def check(found: MeasuredTable, want: MeasuredTable) -> None:
    for name in ("input_mm", "gap_mm", "time_s", "midline_mm", "u_random_mm", "force_n"):
        mine = getattr(found, name)
        assert mine is not None, name
        np.testing.assert_allclose(mine, getattr(want, name), **SAME, err_msg=name)
    assert found.runs == want.runs
    plain = {name.replace(".", "_").replace(" ", "_"): each for name, each in found.channels.items()}
    assert set(plain) == {name.replace(".", "_") for name in want.channels}
    for name, each in want.channels.items():
        mine = plain[name.replace(".", "_")]
        np.testing.assert_array_equal(mine.present, each.present)
        np.testing.assert_allclose(mine.value[each.present], each.value[each.present], **SAME)
        assert mine.u is not None
        assert each.u is not None
        np.testing.assert_allclose(mine.u[each.present], each.u[each.present], **SAME)


@pytest.mark.parametrize(
    "make",
    [german_excel, unicode_tabs, units_row, micrometres_in_brackets, workbook, parquet, matlab, tdms],
    ids=lambda make: make.__name__,
)
def test_every_column_of_a_measured_table_survives(
    make: Callable[[Path, dict[str, list[str]]], Path], tmp_path: Path
) -> None:
    texts = contract()
    want = read_measured_table(own(tmp_path / "own.csv", texts))
    assert set(want.channels) == {"link_2.x_mm", "hinge_1.angle_mrad"}
    check(read_measured_table(make(tmp_path, texts)), want)


def test_a_column_of_another_dimension_is_no_channel(tmp_path: Path) -> None:
    texts = contract()
    plain = {name: texts[name] for name in ("time_s", "input_mm", "gap_mm")}
    path = tmp_path / "log.csv"
    head = "time_s;input_mm;gap_mm;temperature [°C];voltage (V);share [%];Position command [mm];u_lonely_mm"
    rows = [";".join([*row, "20.1", "3.3", "5", "0.1", "0.2"]) for row in zip(*plain.values(), strict=True)]
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    found = read_measured_table(path)
    assert not [name for name in found.channels if not name.startswith("Position")]


def test_force_of_a_foreign_simulation_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "sim.txt"
    lines = ["% x (um)\tgap (mm)\tReaction force (mN)", *(f"{100 * k}\t{1 + k}\t{250 * k}" for k in range(6))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    model = read_simulation_table(path)
    assert model.respond(np.array([0.3])).gap_mm == pytest.approx([4.0])
