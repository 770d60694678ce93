"""Numbers with three decimals and a comma, the default of LabVIEW, are never taken for groups of thousands."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import DataError
from fingervision.tables.read import read_measured_table

TIME_S = 0.05 * np.arange(40)
HALF_OF_LAST_DIGIT = 0.0005
SHAPES = {
    "semicolons": ("{};{};{}", "Zeit [s];Weg [mm];Abstand [mm]"),
    "tabs": ("{}\t{}\t{}", "time_s\tinput_mm\tgap_mm"),
    "blanks": ("{}  {}  {}", "time_s  position_mm  gap_mm"),
    "bars": ("{} | {} | {}", "Time (s) | Position (mm) | Gap (mm)"),
    "quotes": ('"{}","{}","{}"', "time_s,position_mm,gap (mm)"),
    "names before numbers": ("t={}s x={}mm gap={}mm", ""),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("stroke_mm", [0.05, 0.19, 0.9])
def test_three_decimals_and_a_comma_are_decimals(shape: str, stroke_mm: float, tmp_path: Path) -> None:
    input_mm = 0.5 * stroke_mm * (1.0 - np.cos(np.pi * TIME_S))
    gap_mm = 1.2 + 2.0 * input_mm
    row, header = SHAPES[shape]
    rows = [
        row.format(*(f"{value:.3f}".replace(".", ",") for value in values))
        for values in zip(TIME_S, input_mm, gap_mm, strict=True)
    ]
    table = tmp_path / "table.txt"
    table.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    found = read_measured_table(table)
    np.testing.assert_allclose(found.input_mm, input_mm, atol=HALF_OF_LAST_DIGIT)
    np.testing.assert_allclose(found.gap_mm, gap_mm, atol=HALF_OF_LAST_DIGIT)


def test_commas_for_marks_and_separators_are_refused_without_a_header_too(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("\n".join(f"0,{k:03},1,{3 * k:03}" for k in range(40)), encoding="utf-8")
    with pytest.raises(DataError, match="semicolons"):
        read_measured_table(table)
