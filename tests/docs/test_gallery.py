"""Every script of the gallery runs without a warning and makes a picture."""

import runpy
from pathlib import Path

import matplotlib as mpl
import pytest

from fingervision import effects

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(GALLERY.glob("plot_*.py")), ids=lambda path: path.stem)
def test_script_runs_and_makes_a_picture(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    monkeypatch.chdir(tmp_path)
    before = set(effects.catalogue())
    try:
        names = runpy.run_path(str(script), run_name="__main__")
    finally:
        plt.close("all")
        for name in set(effects.catalogue()) - before:
            effects.withdraw(name)
    assert names["figure"].axes


def test_the_gallery_is_whole() -> None:
    for script in GALLERY.glob("plot_*.py"):
        text = script.read_text(encoding="utf-8")
        heading, line = text.splitlines()[1:3]
        assert set(line) == {"="}
        assert len(line) >= len(heading), script.name
