"""How Sphinx builds the documentation: ``make docs``."""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
PROJECT = DOCS.parent
sys.path.insert(0, str(PROJECT))

import kankaku  # noqa: E402 - found on the path above
from tools.api_pages import write_pages  # noqa: E402 - found on the path above
from tools.reference_pages import write_reference  # noqa: E402 - the same

write_pages(DOCS / "api" / "_pages")
write_reference(DOCS / "guide" / "_pages")

facts = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]
project = "Kankaku"
author = facts["authors"][0]["name"]
copyright = author  # noqa: A001 - as Sphinx calls it
version = release = facts["version"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples", "tutorials"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
add_module_names = False
python_use_unqualified_type_names = True
toc_object_entries = False
sphinx_gallery_conf = {
    "examples_dirs": "tutorials",
    "gallery_dirs": "_tutorials",
    "filename_pattern": r"/plot_",
    "plot_gallery": hasattr(kankaku, "run_study"),
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "abort_on_example_error": True,
    "reset_modules": ("tools.tutorials.forget_layers",),
    "image_scrapers": ("tools.tutorials.show_figure",),
    "within_subsection_order": "FileNameSortKey",
    "write_computation_times": False,
}

html_theme = "pydata_sphinx_theme"
html_title = f"Kankaku {version}"
html_show_sourcelink = False
# Pages that stand alone have nothing to list beside them.
html_sidebars: dict[str, list[str]] = {
    page: [] for page in ("approach", "model", "papers", "glossary", "results", "changelog")
}
html_theme_options = {
    "show_toc_level": 2,
    "collapse_navigation": True,
    "navigation_depth": 2,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
}

TYPE = ":type: "
REFERENCE = re.compile(r"^(\s*)\.\. \[\d+\] ")
SOURCES = re.compile(r"\]\((?:\.\./)*scenarios/(\w+)/SOURCES\.md\)")


def mend_docstring(*arguments: Any) -> None:  # noqa: ANN401 - as Sphinx calls it
    """Let a docstring count its references from 1, and take no sentence for a type."""
    lines: list[str] = arguments[-1]
    for number, line in enumerate(lines):
        lines[number] = REFERENCE.sub(r"\1#. ", line).replace("]_", "]")
        if line.startswith(TYPE):
            # Napoleon takes what stands before a colon for the type of an attribute.
            lines[0] = f"{line.removeprefix(TYPE)}: {lines[0]}"
            lines[number] = ""


def point_to_pages(_app: Sphinx, name: str, source: list[str]) -> None:
    """Lead to the page that holds a scenario's sources, not to the file."""
    up = "../" * name.count("/")
    source[0] = SOURCES.sub(rf"]({up}scenarios/\1.md)", source[0])


def look_up_own_names_only(_app: Sphinx, document: nodes.document) -> None:
    """Leave foreign types as plain text: to look for them everywhere takes most of the time."""
    for link in list(document.findall(pending_xref)):
        target = link.get("reftarget", "")
        if link.get("refspecific") and not target.startswith("kankaku"):
            link.replace_self(nodes.Text(target.rsplit(".", 1)[-1]))


def setup(app: Sphinx) -> None:
    """Connect them; the first one after napoleon."""
    app.connect("doctree-read", look_up_own_names_only)
    app.connect("autodoc-process-docstring", mend_docstring, priority=900)
    app.connect("source-read", point_to_pages)
