"""Small plot of a curve, embedded in the HTML page."""

from collections.abc import Sequence

WIDTH_PX, HEIGHT_PX, MARGIN_PX = 156, 44, 2


def small_picture(curve: Sequence[float | None]) -> str:
    """Plot evenly spaced values as SVG, scaled to the range of the values; missing values leave gaps in the curve.

    Parameters
    ----------
    curve : sequence of float or None
        Values of the curve; None for a missing value.
    """
    there = [value for value in curve if value is not None]
    lines = ""
    if there:
        low, high = min(there), max(there)
        step_px = (WIDTH_PX - 2 * MARGIN_PX) / max(1, len(curve) - 1)
        scale_px = (HEIGHT_PX - 2 * MARGIN_PX) / (high - low) if high > low else 0.0
        middle_px = 0.0 if high > low else HEIGHT_PX / 2 - MARGIN_PX
        piece: list[str] = []
        for number, value in enumerate([*curve, None]):
            if value is not None:
                y_px = HEIGHT_PX - MARGIN_PX - middle_px - (value - low) * scale_px
                piece.append(f"{MARGIN_PX + number * step_px:.0f},{y_px:.1f}")
            elif piece:
                # A single point is drawn as a line of zero length, whose round ends make a dot.
                lines += f'<polyline points="{" ".join(piece * 2 if len(piece) == 1 else piece)}"/>'
                piece = []
    return (
        f'<svg width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="none" stroke="#11507a" stroke-width="1.5" '
        f'stroke-linecap="round">{lines}</svg>'
    )
