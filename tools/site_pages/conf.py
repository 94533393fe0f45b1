"""Sphinx's settings; ``tools/build_site.py`` makes the folder of sources."""

import posixpath

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

import desim

project = "desim"
author = "The desim developers"
release = version = desim.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "index"
include_patterns = ["index.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**.md", "reference/**"]
myst_heading_anchors = 4  # named as Git hosts name them
myst_enable_extensions = ["attrs_inline"]
html_theme = "furo"
html_title = "desim"
html_show_sourcelink = False
html_copy_source = False
smartquotes = False  # --set stays --set
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True


def setup(app: Sphinx) -> None:
    """Let browsers open the reports of studies, which Sphinx would let them save."""
    app.connect("doctree-resolved", _opened)


def _opened(app: Sphinx, doctree: nodes.document, page: str) -> None:
    for link in list(doctree.findall(addnodes.download_reference)):
        if link["reftarget"].endswith(".html"):
            place = posixpath.relpath(f"_downloads/{link['filename']}", posixpath.dirname(page))
            link.replace_self(nodes.reference("", "", *link.children, refuri=place, internal=True))
