"""`calibrate scale`: read the picture of a line scale, call calib, write the calibration and its picture, report."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision.cli import _calibration_report as report
from fingervision.cli._bench_limits import limits_from
from fingervision.cli._calibrating import refuse_foreign, sentences, write_picture, written
from fingervision.cli._picture_response import PictureResponse
from fingervision.cli._references import read_pictures, region_from

if TYPE_CHECKING:
    from calib.line_scale import ScaleLines
    from calib.scale_from_lines import LineScaleFit


def calibrate_on_lines(
    image: Path,
    pitch_mm: float,
    u_line_mm: float,
    u_length_mm: float,
    roi: str | None,
    out: Path,
    certificate: str,
    date: str,
    response: str,
    camera: Sequence[str],
    no_picture: bool,
    as_json: bool,
    **limits: float | None,
) -> None:
    """Calibrate on a line scale; arguments are the options of the command."""
    with sentences():
        from calib.calibration_picture import picture_of_lines
        from calib.line_scale import find_lines
        from calib.measured_scale import Reference
        from calib.scale_from_lines import scale_from_lines

        refuse_foreign(out)
        (stored,) = read_pictures([image])
        read_with = PictureResponse.of(response, [image])
        bench, stated = limits_from(limits, lens_calibrated=False)
        lines = find_lines(read_with.light(stored), region_from(roi))
        height, width = stored.shape
        reference = Reference(f"line scale {image.name}", pitch_mm, u_length_mm, certificate, date)
        fit = scale_from_lines(lines, pitch_mm, u_line_mm, u_length_mm, (width, height), bench, reference, stated)
        # A response moves the two edges of a line in opposite senses: its middle, and so the scale, stays.
        calibration = written(read_with.noted(fit.calibration, 0.0), out, camera)
        if not no_picture:
            words = f"{image.name}: {len(lines.at_px)} lines, pitch {pitch_mm:g} mm"
            write_picture(out, image.name, picture_of_lines(stored, lines, fit.used, fit.residual_um, words))
        if as_json:
            click.echo(json.dumps(report.as_json(calibration, _more(fit, lines, out))))
            return
        text = [*report.scale_lines(calibration), *_lines(fit, lines), *report.budget_lines(calibration)]
        click.echo("\n".join([*text, "", f"Written: {out}"]))


def _more(fit: "LineScaleFit", lines: "ScaleLines", out: Path) -> dict[str, object]:
    return {
        "out": str(out),
        "bias_known": False,
        "lines": len(lines.at_px),
        "lines_used": int(fit.used.sum()),
        "dark": lines.is_dark,
        "line_width_mm": fit.width_mm,
        "u_line_width_mm": fit.u_width_mm,
        "px_per_mm_by_rising_edges": fit.by_edge[0],
        "px_per_mm_by_falling_edges": fit.by_edge[1],
        "largest_residual_um": float(abs(fit.residual_um[fit.used]).max()),
        "chi_square": fit.chi_square,
        "freedom": fit.freedom,
    }


def _lines(fit: "LineScaleFit", lines: "ScaleLines") -> list[str]:
    rising, falling = fit.by_edge
    scale = fit.calibration.px_per_mm
    tone = "dark" if lines.is_dark else "light"
    text = [
        "",
        f"lines      {int(fit.used.sum())} of {len(lines.at_px)} {tone} lines used, over "
        f"{fit.calibration.references[0].size_mm:g} mm; edges spread over {lines.blur_px:.2f} px (sigma)",
        f"edges      by rising edges alone {100 * (rising / scale - 1):+.4f} %, by falling ones "
        f"{100 * (falling / scale - 1):+.4f} % against the lines' middles",
        f"residuals  {float(abs(fit.residual_um[fit.used]).max()):.3f} um at most; chi square {fit.chi_square:.1f} "
        f"with {fit.freedom} degrees of freedom (chance {100 * fit.probability:.1f} %)",
    ]
    if fit.width_mm is not None:
        text.insert(3, f"width      {1e3 * fit.width_mm:.2f} um as the lines look (edge bias not taken off)")
    else:
        text.insert(3, "width      not told: the lines are narrower than twice their blur")
    if fit.probability < 0.01:
        text.append(
            "The lines do not stand at equal distances within their uncertainties, which were enlarged to match."
        )
    if lines.is_clipped:
        text.append("Part of the picture stands at an end of the grey scale: the lines' widths may be off by that.")
    return text
