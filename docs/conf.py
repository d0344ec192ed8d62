"""How Sphinx builds the documentation: `sphinx-build -W --keep-going -b html docs build/docs`. No network is needed."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "extensions")]

import gallery  # noqa: E402

from pointshade_gl import __version__  # noqa: E402

project, release, author = "pointshade_gl", __version__, "The authors of pointshade_gl"
project_copyright = author
language = "en"

extensions = ["myst_parser", "sphinx_copybutton", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
extensions += ["commands", "docstrings", "layers", "mathml", "side_by_side"]  # our own, in docs/extensions
exclude_patterns = ["**sg_execution_times.rst"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}  # sphinx-gallery writes the second
# The source files of Markdown stay readable on GitHub: links are relative, and pictures beside each other are lines of
# one paragraph.

# The gallery: sphinx-gallery makes docs/auto_examples, which git ignores, of examples/.
extensions += ["sphinx_gallery.gen_gallery", "gallery"]
sphinx_gallery_conf = gallery.CONFIGURATION

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_fence_as_directive = ["mermaid"]  # GitHub draws it itself
myst_heading_anchors = 4

autodoc_default_options = {"members": True, "inherited-members": True, "member-order": "bysource"}
autodoc_typehints = "none"  # the docstrings say more: shapes, units, and what a value means
autosummary_generate = False
add_module_names = False
toc_object_entries_show_parents = "hide"
default_role = "code"
smartquotes_action = "D"  # dashes; quotes are those of code
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"pointshade_gl {release}"
html_static_path = ["_static"]
html_css_files = ["page.css"]
html_domain_indices = False
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_math_renderer = "mathml"
pygments_style = "friendly"
pygments_dark_style = "github-dark"
html_logo, html_favicon = "_static/vase.png", "_static/favicon.png"  # of `pointshade render --light -.5,-.7,.2`
