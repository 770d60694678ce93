"""Outlines of deformed plates: chords agree with the parabola, loops are closed, holes have the opposite direction."""

import numpy as np
import pytest

from tests.deformed_plate import deformed_outlines


def ring(radius: float, count: int, centre: float, *, inwards: bool) -> tuple[np.ndarray, np.ndarray]:
    """Parabolas through points of a circle."""
    at = np.linspace(0.0, 2.0 * np.pi, 2 * count, endpoint=False) * (-1.0 if inwards else 1.0)
    nodes = centre + radius * np.stack([np.cos(at), np.sin(at)])
    first = 2 * np.arange(count)
    return np.stack([first, (first + 2) % (2 * count), first + 1]), nodes


def test_a_circle_of_parabolas_keeps_its_area() -> None:
    edges, nodes = ring(40.0, 60, 100.0, inwards=False)
    (outline,) = deformed_outlines(edges[:, ::-1], nodes)
    assert abs(outline.area_px2) == pytest.approx(np.pi * 1600.0, rel=3e-5)


def test_a_hole_runs_the_other_way() -> None:
    outer, nodes = ring(40.0, 60, 100.0, inwards=False)
    inner, more = ring(10.0, 30, 100.0, inwards=True)
    outlines = deformed_outlines(np.hstack([outer, inner + nodes.shape[1]]), np.hstack([nodes, more]))
    assert sorted(np.sign(outline.area_px2) for outline in outlines) == [-1.0, 1.0]
