"""With a drawing, the fingers and pairs of a whole mechanism are measured without a stated region."""

import json
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


def test_a_stated_scale_enters_the_poses_and_cancels_in_their_motion(tmp_path: Path) -> None:
    film, stated = filmed(tmp_path / "film", 1.0), 0.999 * PX_PER_MM
    given = ["measure", str(film), "--rate-hz", "25", "--px-per-mm", str(stated), "--u-px-per-mm", "0.01"]
    printed(*given, "--mechanism", str(DRAWING), "--frames", "0:2", "--out", str(tmp_path / "out"))
    rows = csv_rows(tmp_path / "out" / "bodies.csv")
    assert {row["frame"] for row in rows} == {"0", "1", "2"}
    for body, way in (("right_jaw", -1.0), ("left_jaw", 1.0)):
        own = [row for row in rows if row["body"] == body]
        error = np.array([[float(row["x_mm"]) - way * closed, float(row["y_mm"])]
                          for row, closed in zip(own, CLOSED_MM, strict=False)])  # fmt: skip
        u, u_motion = (np.array([[float(row[f"{name}_{part}_mm"]) for part in "xy"] for row in own])
                       for name in ("u", "u_motion"))  # fmt: skip
        assert np.all(np.abs(error) < 2.0 * u)
        assert np.all(np.abs(error - error[0]) <= 3.0 * u_motion)
        # The jaws lie 25 mm from the ground by which the drawing is placed: 0.1 % of this is common to all frames.
        assert np.all(u[:, 1] > 0.02)
        assert np.all(u_motion < 0.01)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    jaw = summary["mechanism"]["bodies"]["left_jaw"]
    assert jaw["counts"] == {"ok": 3}
    assert jaw["x_mm"]["greatest"] - jaw["x_mm"]["least"] == pytest.approx(0.9, abs=0.01)
    for row in csv_rows(tmp_path / "out" / "gauges.csv"):
        assert float(row["u_motion"]) < 0.5 * float(row["u"])
