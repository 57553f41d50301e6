"""The documentation as one static site: `make docs` builds it in out/site. References and pictures
of effects are generated from the program."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
checkout = (ROOT / "thermospindle" / "model").is_dir()  # a source package has no links there: what is installed is documented
sys.path[:0] = [str(HERE), str(ROOT)] if checkout else [str(HERE)]

from generated import write_all  # noqa: E402

project = "Thermospindle"
author = "the Thermospindle developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
default_role = "code"
highlight_language = "none"  # commands and files; what is Python says so
html_theme = "furo"
html_title = "Thermospindle"
html_show_copyright = False
html_static_path = ["style"]
html_css_files = ["site.css"]
exclude_patterns = ["_build"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
nitpicky = False
smartquotes = False  # --scene is an option, no dash


def setup(app):
    app.connect("config-inited", lambda app, config: write_all(HERE / "generated"))
