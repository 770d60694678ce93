"""Gauges from a gauge file, tracked through pictures without a recording."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fingervision.domain.frame import Frame
from fingervision.gauges.gauge_file import Gauge, read_gauges
from fingervision.gauges.kinds import measured_together
from fingervision.gauges.picture import picture_of
from fingervision.gauges.reading import Reading
from fingervision.vision.pipeline import Settings


def gauges_of(folder: Path, *tables: str) -> tuple[Gauge, ...]:
    """Write tables of a gauge file and read them; a missing name is added."""
    text = "schema = 1\n"
    for number, table in enumerate(tables):
        name = "" if "name =" in table else f'name = "g{number}"\n'
        text += f"[[gauge]]\n{name}{table}\n"
    path = folder / "gauges.toml"
    path.write_text(text, encoding="utf-8")
    return read_gauges(path)


def followed(gauges: tuple[Gauge, ...], pictures: Iterable[np.ndarray]) -> list[list[Reading]]:
    """Readings of every picture, in order."""
    followers = [gauge.spec.follower() for gauge in gauges]
    settings = Settings(10.0)
    return [
        list(measured_together(followers, picture_of(Frame(picture, index), settings)))
        for index, picture in enumerate(pictures)
    ]


def share_within(errors: Iterable[float], u: Iterable[float], k: float = 1.96) -> float:
    """Share of errors within k standard uncertainties."""
    return float(np.mean(np.abs(np.array(list(errors))) <= k * np.array(list(u))))
