"""The page and figures of a report are self-contained vector graphics with the numbers of report.json."""

import json
import re
import shutil
from collections.abc import Iterator
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from matplotlib.text import Text

from fingervision.cli import cli
from fingervision.diagnosis.report.figure_files import effect_figure
from fingervision.diagnosis.report.frame_strip import strip_html, turning_rows
from fingervision.diagnosis.report.html_parts import GapCurves, bullets, named
from fingervision.diagnosis.report.paper_figure import WIDTHS_MM, paper_figure
from fingervision.domain.errors import UsageError
from fingervision.effects import catalogue

CHROMIUM = shutil.which("chromium")
PLAY_MM = 0.05
PATIENCE_MS = 120_000
"""Time limit for a browser on a loaded computer."""
# A file name with HTML markup, which would start an element wherever it is not escaped.
MARKUP = "<img src=x onerror=alert(1)><script>alert(1)<"
MEASURED, STRAIGHT = f"measured {MARKUP}.csv", f"straight {MARKUP}.csv"


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tables of a straight model, a model with a slope 10 % wrong, and a measurement with play."""
    folder = tmp_path_factory.mktemp("rig <b>")
    rng = np.random.default_rng(11)
    turns = np.concatenate([np.linspace(0, 1, 80), np.linspace(1, 0, 80)])
    u = np.concatenate([turns, turns])
    place = u[0]
    gap = []
    for x in u.tolist():
        place = min(max(place, x - PLAY_MM / 2), x + PLAY_MM / 2)
        gap.append(2.0 + 3.0 * place + 0.001 * rng.standard_normal())
    run = f"1 {MARKUP}/script>"
    rows = "\n".join(
        f"{0.1 * k:.2f},{x:.6f},{g:.6f},{run}" for k, (x, g) in enumerate(zip(u.tolist(), gap, strict=True))
    )
    (folder / MEASURED).write_text(f"time_s,input_mm,gap_mm,run\n{rows}\n", encoding="utf-8")
    (folder / STRAIGHT).write_text("input_mm,gap_mm\n-0.1,1.7\n1.1,5.3\n", encoding="utf-8")
    (folder / "steep.csv").write_text("input_mm,gap_mm\n-0.1,1.67\n1.1,5.63\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def answer(rig: Path) -> Path:
    out = rig / "answer"
    done = run("diagnose", rig / MEASURED, "--model", rig / STRAIGHT, "--out", out)
    assert done.exit_code == 0, done.output
    return out


def numbers_in(document: object) -> Iterator[float]:
    if isinstance(document, dict):
        for value in document.values():
            yield from numbers_in(value)
    elif isinstance(document, list):
        for value in document:
            yield from numbers_in(value)
    elif isinstance(document, int | float) and not isinstance(document, bool):
        yield float(document)


def test_every_number_of_the_page_is_in_the_report(answer: Path) -> None:
    page = (answer / "report.html").read_text(encoding="utf-8")
    known = set(numbers_in(json.loads((answer / "report.json").read_text(encoding="utf-8"))))
    shown = [float(value) for value in re.findall(r'<data value="([^"]+)"', page)]
    assert len(shown) > 5
    assert all(value in known for value in shown)


def test_the_page_asks_nobody(answer: Path) -> None:
    page = (answer / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r'(?:src|href)="(?!data:|#)[^"]*"', page)
    assert len(page) < 2_000_000


def test_every_chart_of_the_page_has_its_numbers(answer: Path) -> None:
    page = (answer / "report.html").read_text(encoding="utf-8")
    held = json.loads(re.findall(r'<script type="application/json" id="figures">(.*?)</script>', page)[0])
    placed = re.findall(r'<div class="chart" id="([^"]+)"', page)
    assert [each["id"] for each in held] == placed
    assert {"gap-input", "residual-time", "effect-backlash-input"} <= set(placed)
    shown = [value for each in held for series in each["series"] for value in series["values"] if value is not None]
    assert np.ptp(shown) > 0.0


class Elements(HTMLParser):
    """Elements of a page with their attributes, and the text within its scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def check_markup_is_text(page: str) -> None:
    assert "&lt;img src=x" in page
    assert "<script>alert" not in page
    for tag, attributes in Elements(page).found:
        assert not any(name.startswith("on") for name in attributes), (tag, attributes)
        assert attributes.get("src") != "x", tag


def test_markup_in_the_names_of_files_and_runs_is_text(answer: Path) -> None:
    check_markup_is_text((answer / "report.html").read_text(encoding="utf-8"))


def test_markup_in_a_sentence_of_the_report_is_text() -> None:
    assert "<img" not in bullets([MARKUP])
    assert "<img" not in named(MARKUP)


def test_figures_are_vectors_and_the_same_each_time(rig: Path, answer: Path) -> None:
    again = rig / "again"
    assert run("diagnose", rig / MEASURED, "--model", rig / STRAIGHT, "--out", again).exit_code == 0
    for name in ("gap_against_input", "gap_against_input_85mm", "gap_over_time", "residuals"):
        drawn = (answer / f"{name}.svg").read_bytes()
        assert drawn == (again / f"{name}.svg").read_bytes()
        assert b"<image" not in drawn
        assert b"mm" in drawn
        pdf = (answer / f"{name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF")
        assert b"/Subtype /Image" not in pdf


def test_dashes_stay_dashes_where_the_input_goes_forth_and_back() -> None:
    input_mm = np.concatenate([np.linspace(0.0, 0.5, 60), np.linspace(0.5, 0.0, 60), np.linspace(0.0, 0.5, 60)])
    opens = np.repeat([True, False, True], 60)
    predictions = {"static": 1.0 + 7.0 * input_mm, "loop": 1.0 + 7.0 * input_mm + 0.4 * ~opens}
    zero = np.zeros(180)
    curves = GapCurves(input_mm, predictions["loop"], zero, opens, None, (slice(0, 180),), predictions)
    static, *loop = [line for line in paper_figure(curves).axes[0].get_lines() if line.get_linestyle() != "None"]
    assert np.all(np.diff(static.get_xdata()) >= 0.0)
    # Both branches of a loop are drawn, each in its own style.
    assert {line.get_linestyle() for line in loop if np.ptp(line.get_ydata()) > 3.0} == {"-", "--"}
    drawn = {(x, y) for line in loop for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)}
    assert drawn == set(zip(input_mm, predictions["loop"], strict=True))


@pytest.mark.parametrize("width_mm", WIDTHS_MM.values())
def test_the_figure_for_a_paper_shows_apart_what_coincides(width_mm: float) -> None:
    input_mm = np.concatenate([np.linspace(0.0, 1.0, 100), np.linspace(1.0, 0.0, 100)])
    opens = np.repeat([True, False], 100)
    model = 4.0 + 7.7 * input_mm
    curves = GapCurves(
        input_mm, model - 0.05 * opens, np.full(200, 0.01), opens, None, (slice(0, 200),), {"model": model}
    )
    figure = paper_figure(curves, "Title", width_mm=width_mm)
    assert figure.get_size_inches()[0] * 25.4 == pytest.approx(width_mm)
    figure.draw_without_rendering()
    upper, lower = figure.axes
    (inset,) = upper.child_axes
    # In the inset, the two directions are apart by a tenth of its height or more.
    assert 0.05 / np.ptp(inset.get_ylim()) > 0.1
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["measured, opening", "measured, closing", "±U, random (k = 2)", "model, opening", "model, closing"]
    assert {line.get_markerfacecolor() == line.get_color() for line in lower.get_lines()[1:]} == {True, False}
    sizes = {text.get_fontsize() for text in figure.findobj(Text) if text.get_text()}
    assert sizes == {8.0}
    edges = figure.legends[0].get_window_extent()
    assert edges.x1 <= figure.bbox.x1


def test_a_table_of_five_inputs_has_its_figure_without_a_warning() -> None:
    # A warning is an error in tests: five inputs do not determine the six coefficients of a curve of the fifth degree.
    input_mm = np.tile(np.concatenate([np.arange(5.0), np.arange(5.0)[::-1]]), 3)
    opens = np.tile(np.repeat([True, False], 5), 3)
    model = 4.0 + 7.7 * input_mm
    curves = GapCurves(
        input_mm, model - 0.05 * opens, np.full(30, 0.01), opens, None, (slice(0, 30),), {"model": model}
    )
    assert paper_figure(curves).axes[0].child_axes


def test_curves_that_are_apart_need_no_inset() -> None:
    input_mm = np.linspace(0.0, 1.0, 50)
    model = 4.0 + 7.7 * input_mm
    curves = GapCurves(
        input_mm, model + 1.0, np.full(50, 0.01), np.ones(50, dtype=bool), None, (slice(0, 50),), {"model": model}
    )
    assert not paper_figure(curves).axes[0].child_axes


def test_a_name_of_no_model_is_refused(rig: Path) -> None:
    done = run("compare", rig / MEASURED, "--model", rig / STRAIGHT, "--name", "other.csv=words")
    assert isinstance(done.exception, UsageError)


def test_several_models_stand_in_one_table_and_title_and_names_in_the_figures(rig: Path, answer: Path) -> None:
    out = rig / "both"
    models = [rig / "steep.csv", rig / STRAIGHT, answer / "model.toml"]
    words = [word for model in models for word in ("--model", model)]
    words += ["--name", "steep.csv=finite elements", "--title", "Gripper 3"]
    done = run("compare", rig / MEASURED, *words, "--out", out, "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)["models"]
    rms = {one["model"]: one["rms_mm"] for one in found}
    assert list(rms) == ["finite elements", STRAIGHT, "model.toml"]
    assert rms["model.toml"] < rms[STRAIGHT] < rms["finite elements"]
    drawn = (out / "compare_gap_against_input.svg").read_text(encoding="utf-8")
    assert "finite elements, opening" in drawn
    assert "Gripper 3" in drawn
    page = (out / "compare.html").read_text(encoding="utf-8")
    assert all(escape(name) in page for name in rms)
    check_markup_is_text(page)
    # A comparison and a diagnosis may be written to the same folder, so that their file names must differ.
    of_answer = {each.name for each in answer.iterdir() if each.is_file() and each.name.startswith(("gap_", "resid"))}
    assert of_answer
    assert not of_answer & {each.name for each in out.iterdir()}


def test_one_model_is_diagnosed_at_a_time(rig: Path) -> None:
    done = run("diagnose", rig / MEASURED, "--model", rig / STRAIGHT, "--model", rig / "steep.csv")
    assert done.exit_code == 2
    assert "compare" in done.output


def test_the_same_model_twice_is_refused(rig: Path) -> None:
    done = run("compare", rig / MEASURED, "--model", rig / "steep.csv", "--model", rig / "steep.csv")
    assert isinstance(done.exception, UsageError)


@pytest.mark.slow
def test_turning_points_are_found_and_their_frames_shown(tmp_path: Path) -> None:
    sample = Path(__file__).parents[2] / "sample_frames" / "opening"
    recording = tmp_path / "opening.mp4"
    shutil.copy(sample / recording.name, recording)
    words = ("--calibration", sample / "calibration.json", "--drive", sample / "drive.csv", "--out", tmp_path / "gaps")
    assert run("measure", recording, *words).exit_code == 0
    table = tmp_path / "gaps" / "gaps.csv"
    turns = turning_rows(table)
    drive = np.genfromtxt(sample / "drive.csv", delimiter=",", names=True)["input_mm"]
    # The drive opens the gripper, closes it and returns.
    assert [turn.input_mm for turn in turns[1:3]] == pytest.approx([drive.max(), drive.min()], abs=0.02)
    strip = strip_html(table)
    assert strip.count("<img") == len(turns)
    assert f"gap {turns[1].gap_mm:.3f} mm" in strip
    # A table that was moved away from the recording still contains the path of the recording.
    elsewhere = tmp_path / "results" / "of" / "today"
    shutil.copytree(table.parent, elsewhere)
    assert strip_html(elsewhere / "gaps.csv") == strip
    recording.write_bytes(recording.read_bytes()[:-1])
    assert "<img" not in strip_html(table)  # a different file of the same name is not used


@pytest.fixture(scope="module")
def pages(rig: Path, answer: Path) -> list[Path]:
    """Pages of a diagnosis, of a comparison of several models, and of a report with ISO 230-2 quantities."""
    words = [word for name in ("steep.csv", STRAIGHT) for word in ("--model", rig / name)]
    assert run("compare", rig / MEASURED, *words, "--out", rig / "several").exit_code == 0
    rng = np.random.default_rng(8)
    lines = ["target_mm,cycle,direction,deviation_um"]
    for cycle in range(1, 6):
        for side, word in ((1, "up"), (-1, "down")):
            lines += [f"{t},{cycle},{word},{-10.0 * side + rng.normal():.3f}" for t in np.linspace(-3.0, 3.0, 7)]
    (rig / "targets.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (rig / "axis.csv").write_text("input_mm,gap_mm\n-3,-3\n3,3\n", encoding="utf-8")
    assert run("diagnose", rig / "targets.csv", "--model", rig / "axis.csv", "--out", rig / "iso").exit_code == 0
    return [answer / "report.html", rig / "several" / "compare.html", rig / "iso" / "report.html"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed.")
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"], timeout=PATIENCE_MS
        )
        yield found
        found.close()


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed.")
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280, 2560])
def test_a_browser_shows_it_without_a_word_or_a_request(
    pages: list[Path], browser: Any, width: int, scheme: str
) -> None:
    for path in pages:
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        page.set_default_timeout(PATIENCE_MS)
        said: list[str] = []
        asked: list[str] = []
        page.on("console", lambda message, said=said: said.append(message.text))
        page.on("pageerror", lambda error, said=said: said.append(str(error)))
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.goto(path.as_uri())
        page.wait_for_selector("#gap-input canvas")
        page.focus("#gap-input")
        page.keyboard.press("ArrowRight")
        page.wait_for_function("document.querySelector('#gap-input + .readout').textContent.includes('measured')")
        assert page.evaluate("document.documentElement.scrollWidth") <= width, path
        shown = page.evaluate(
            "[...document.querySelectorAll('data')].map((a) => [a.value, a.textContent, a.nextSibling?.data ?? ''])"
        )
        page.close()
        known = set(numbers_in(json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))))
        assert len(shown) > 3
        for value, text, unit in shown:
            assert float(value) in known
            held = float(value) * (100.0 if unit.strip().startswith("%") else 1.0)
            # The displayed number is that of the report, rounded to the displayed digits.
            digits = len(text.partition(".")[2]) if "e" not in text else 0
            assert float(text) == pytest.approx(held, rel=5.1e-4, abs=0.51 * 10.0**-digits)
        assert said == []
        assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_effect_has_a_figure_in_which_it_shows(name: str) -> None:
    lines = [line for axes in effect_figure(name).axes for line in axes.lines]
    assert max(float(np.ptp(np.asarray(line.get_ydata(), dtype=float))) for line in lines) > 0.0
