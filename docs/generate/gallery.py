"""Settings of the gallery: scripts of `docs/gallery` are run, shown with their pictures, and offered as notebooks."""

from typing import Any

from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst


def figures_of(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the figures that a script has named, also those that are not drawn by pyplot."""
    paths = []
    for figure in {id(each): each for each in block_vars["example_globals"].values()}.values():
        if isinstance(figure, Figure) and not hasattr(figure, "in_gallery"):
            figure.in_gallery = True  # type: ignore[attr-defined]
            paths.append(next(block_vars["image_path_iterator"]))
            figure.savefig(paths[-1], dpi=150)
    plt.close("all")
    return str(figure_rst(paths, gallery_conf["src_dir"]))


SETTINGS = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "image_scrapers": ("generate.gallery.figures_of",),
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,  # its page loads scripts from another host
    "capture_repr": (),
    "within_subsection_order": "FileNameSortKey",
}
