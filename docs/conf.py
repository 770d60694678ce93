"""How Sphinx builds the manual: Markdown in, a folder of pages out, without network at build or at reading time."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

from generate.gallery import SETTINGS  # noqa: E402

from fingervision import __version__  # noqa: E402 - found by the path above

project = "fingervision"
author = "the fingervision contributors"
project_copyright = "the fingervision contributors, BSD-3-Clause"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "generate.pages",  # reference pages from the program itself
    "generate.mathml",  # formulas become MathML at build time
]
exclude_patterns = ["_build", "_generated", "generate", "figures/*.py", "paper.md", "gallery"]

# Markdown as code hosts read it: $ maths $, tables, bare links, anchors of headings like theirs.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

# A link to nothing is an error (the build runs with -W), also in docstrings.
nitpicky = False
# `Calibration` in a signature may be the interface's or calib's: either link is right enough.
suppress_warnings = ["ref.python"]

# Docstrings are numpydoc; single backticks there mean code.
default_role = "literal"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False
napoleon_use_ivar = True
# The types of arguments stand in the docstrings; in a signature of fifteen arguments they hide the names.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
python_use_unqualified_type_names = True

# The gallery: scripts that are run when the manual is built.
sphinx_gallery_conf = SETTINGS

# Furo carries its own styles and scripts and uses the reader's fonts: nothing is fetched.
html_theme = "furo"
html_title = f"fingervision {release}"
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"top_of_page_buttons": []}
# Code is coloured by Pygments at build time.
pygments_style = "friendly"
pygments_dark_style = "native"
