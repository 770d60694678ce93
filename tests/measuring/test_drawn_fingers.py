"""With a drawing, the fingers and pairs of a whole mechanism are measured without a stated region."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from fingervision.models.mechanism_bodies import bodies_of
from fingervision.storage.mechanism_toml import read_drawing
from tests.benchmarks.films_of_mechanisms import DRAWINGS, View
from tests.commands import printed
from tests.csv_rows import csv_rows

DRAWING = DRAWINGS / "leaf_tweezers.toml"
PX_PER_MM, REST_MM = 10.0, {"gap": 3.0, "heels": 6.0}
# Both jaws move towards each other by so much, without turning, as leaves guide them.
CLOSED_MM = (-0.4, 0.0, 0.5, 1.0)


def filmed(folder: Path, angle_deg: float) -> Path:
    """Draw the ground and the jaws, moved, and straight leaves between them."""
    rng = np.random.default_rng(5)
    angle = np.radians(angle_deg)
    view = View(float(angle), PX_PER_MM, (640, 640), (320.0, 320.0), True, 0.9, 1.5)
    c, s = np.cos(angle), np.sin(angle)
    middle = PX_PER_MM * np.array([[c, s], [s, -c]]) @ np.array([0.0, 18.0])
    view = View(view.angle_rad, PX_PER_MM, view.size_px, (320.0 - middle[0], 320.0 - middle[1]), True, 0.9, 1.5)
    mechanism = read_drawing(DRAWING).mechanism()
    folder.mkdir()
    for frame, closed in enumerate(CLOSED_MM):
        loops = []
        for body in bodies_of(mechanism):
            way = {"right_jaw": -closed, "left_jaw": closed}.get(body.name, 0.0)
            loops.append(body.outline.corners_mm + np.array([[way], [0.0]]))
        for x in (6.0, 17.0, -6.0, -17.0):
            way = -np.sign(x) * closed
            loops.append(np.array([[x - 0.3, x + 0.3, x + 0.3 + way, x - 0.3 + way], [-0.5, -0.5, 20.5, 20.5]]))
        cv2.imwrite(str(folder / f"{frame}.png"), view.picture([view.to_px(loop) for loop in loops], rng))
    return folder


@pytest.mark.parametrize("angle_deg", [1.0, 269.0])
def test_a_film_of_a_whole_mechanism_gives_its_gap_and_pairs_in_every_frame(tmp_path: Path, angle_deg: float) -> None:
    film = filmed(tmp_path / "film", angle_deg)
    given = ["measure", str(film), "--rate-hz", "25", "--px-per-mm", str(PX_PER_MM), "--mechanism", str(DRAWING)]
    printed(*given, "--out", str(tmp_path / "out"))
    gaps = csv_rows(tmp_path / "out" / "gaps.csv")
    pairs = csv_rows(tmp_path / "out" / "gauges.csv")
    assert [row["status"] for row in gaps] == ["ok"] * len(CLOSED_MM)
    for row, closed in zip(gaps, CLOSED_MM, strict=True):
        assert float(row["gap_mm"]) == pytest.approx(REST_MM["gap"] - 2.0 * closed, abs=0.006)
    errors = []
    for name, rest in REST_MM.items():
        own = [row for row in pairs if row["gauge"] == name]
        for row, closed in zip(own, CLOSED_MM, strict=True):
            errors.append((float(row["value"]) - rest + 2.0 * closed) / float(row["u"]))
    assert np.sqrt(np.mean(np.square(errors))) < 2.0
    assert np.abs(errors).max() < 4.0
