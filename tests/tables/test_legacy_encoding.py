"""Headers of two or three words in old encodings: read as they were written, and no number of the table changed."""

# Letters of other alphabets are what is tested here.
# ruff: noqa: RUF001

from pathlib import Path

import numpy as np
import pytest

from fingervision.tables.read import read_measured_table
from fingervision.tables.text_file import decode

HEADERS = {
    "gbk": (
        "时间(s),位移(mm),间隙(mm)",
        "时间,输入,开口",
        "位置 (mm);间隙 (mm)",
        "序号\t时间/s\t位移/mm\t力/N",
        "测量时间,编码器位置,夹爪开度",
        "时间 (s), 位移 (um)",
        "周期;速度;误差",
        "左手指 (mm),右手指 (mm)",
        "日期,读数,备注",
        "激光位移计 [mm]",
        "夹持力/mN",
        "通道1,通道2,通道3",
        "采样点;行程;张开量",
    ),
    "koi8-r": (
        "Время (с),Положение (мм),Зазор (мм)",
        "время;перемещение;зазор",
        "Время, с;Ход, мм",
        "Сила (Н),Зазор (мм)",
        "t (с);x (мм);Зазор (мм)",
        "ВРЕМЯ;ЗАЗОР",
        "Координата (мм);Раскрытие (мм)",
        "номер;скорость;усилие",
        "Дата;Показание",
        "Шток, мкм;Губки, мм",
        "левый палец,правый палец",
        "ТАБЛИЦА;ХОД",
    ),
    "cp1251": (
        "Время (с),Положение (мм),Зазор (мм)",
        "время;перемещение;зазор",
        "Время, с;Ход, мм",
        "Сила (Н),Зазор (мм)",
        "t (с);x (мм);Зазор (мм)",
        "ВРЕМЯ;ЗАЗОР",
        "Координата (мм);Раскрытие (мм)",
        "номер;скорость;усилие",
        "Дата;Показание",
        "Шток, мкм;Губки, мм",
        "ТАБЛИЦА;ХОД",
    ),
    "shift_jis": (
        "時間 (s),位置 (mm),ギャップ (mm)",
        "時間,変位,間隔",
        "ストローク(mm);開口(mm)",
        "サンプル番号,電圧 (V),爪の開き (mm)",
        "周期,測定値",
        "レーザ変位計 [mm]",
    ),
    "euc_jp": ("時間 (s),位置 (mm),ギャップ (mm)", "時間,変位,間隔", "サンプル番号,電圧 (V)", "周期,測定値"),
    "big5": ("時間 (s),位移 (mm),間隙 (mm)", "時間,位置,開口", "週期;速度;誤差", "左指 (mm),右指 (mm)"),
    "euc_kr": ("시간 (s),위치 (mm),간격 (mm)", "시간,변위,간극", "그리퍼 폭 (mm)", "측정값;오차", "손가락 왼쪽"),
    "cp1250": (
        "Čas (s);Poloha (mm);Mezera (mm)",
        "Czas [s];Położenie [mm];Szczelina [mm]",
        "Idő (s);Út (mm);Rés (mm)",
        "Siła (N);Odległość (mm)",
        "síla;rozevření",
        "Erő (N);Nyílás (mm)",
        "Síla [N];otvorenie čeľustí",
    ),
    "iso8859-2": ("Czas [s];Położenie [mm];Szczelina [mm]", "Čas (s);Vzdálenost (mm)"),
    "cp1253": ("Χρόνος (s);Θέση (mm);Διάκενο (mm)", "Άνοιγμα (mm);Δύναμη (N)"),
    "cp1254": ("Süre (s);Konum (mm);Açıklık (mm)", "Giriş (mm);Boşluk (mm)", "Kuvvet (N);Açıklık (mm)", "ölçüm;süre"),
    "cp850": ("Zeit (s);Öffnung (µm)", "Größe (mm);Weg (µm)", "Déplacement (mm)"),
    "mac_roman": ("Zeit (s);Öffnung (µm)",),
    "cp437": ("Zeit (s);Weg (µm)",),
    "cp866": ("Координата (мм);Раскрытие (мм)", "номер;скорость;усилие"),
    "cp1252": (
        "Kraft (N);Öffnung (mm);Größe",
        "Déplacement (mm);Écartement (mm)",
        "posición;separación",
        "Posição;Força",
        "Åpning (mm)",
        "Længde;Bredde",
        "Müller",
        "Temps écoulé (s)",
        "Weg [µm];T [°C]",
        "Età;velocità",
    ),
}
ROWS = "\n".join(f"{0.1 * k:.1f},{0.01 * k:.2f},{1 + 0.07 * k:.2f}" for k in range(50))


def read(header: str, encoding: str) -> str:
    return decode(f"{header}\n{ROWS}".encode(encoding))[0]


@pytest.mark.parametrize("encoding", ["gbk", "shift_jis", "euc_jp", "big5", "euc_kr", "cp1252", "cp1253", "cp1254"])
def test_header_is_read_as_it_was_written(encoding: str) -> None:
    for header in HEADERS[encoding]:
        assert read(header, encoding) == f"{header}\n{ROWS}"


def test_few_headers_are_misread_and_no_number_ever() -> None:
    wrong = []
    for encoding, headers in HEADERS.items():
        for header in headers:
            text, _, rows = read(header, encoding).partition("\n")
            assert rows == ROWS
            wrong += [(encoding, header)] * (text != header)
    # Left: a capital C with caron, one header in capitals, letters that two encodings of one language do not share.
    assert len(wrong) <= 5, wrong


@pytest.mark.parametrize(
    ("header", "encoding"), [("\u05d6\u05de\u05df;\u05de\u05e8", "cp1255"), ("\u0e40\u0e27", "cp874")]
)
def test_words_of_no_known_language_still_leave_the_numbers(header: str, encoding: str) -> None:
    assert read(header, encoding).partition("\n")[2] == ROWS


def test_columns_that_are_known_are_read_beside_a_foreign_one(tmp_path: Path) -> None:
    path = tmp_path / "gbk.csv"
    path.write_bytes("时间 (s),input (mm),gap (mm)\n".encode("gbk") + ROWS.encode())
    np.testing.assert_allclose(read_measured_table(path).gap_mm[:2], [1.0, 1.07])


def test_the_words_that_decide_may_stand_far_down() -> None:
    rows = "\r\n".join(["0.1,0.2"] * 30_000)
    text, encoding = decode(f"time,gap\r\n{rows}\r\n# Größe\r\n".encode("cp1252"))
    assert encoding == "cp1252"
    assert text.endswith("# Größe\r\n")
