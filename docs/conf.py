"""Settings of the documentation's site, which ``make docs`` builds.

Its source is the whole repository, so that a link in README or docs holds there and on the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import MathError, tex2mathml
from sphinx import addnodes
from sphinx.util.logging import getLogger

from pamsim import __version__

logger = getLogger(__name__)

project = "pamsim"
author = "The pamsim developers"
copyright = author
version = release = __version__

root_doc = "docs/index"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "docs/*.md",
    "docs/notebooks/*.py",
    "models/*/README.md",
]
exclude_patterns = [".*", "build", "dist", "out", "pamsim", "scripts", "tests"]  # not walked
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
show_warning_types = True
nitpicky = False  # docstrings may name what has no page

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # the anchors that repository hosts give to headings

nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

autodoc_mock_imports = ["stable_baselines3"]  # an extra that brings PyTorch
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
napoleon_use_rtype = False
napoleon_use_ivar = True
default_role = "py:obj"
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"pamsim {release}"
html_math_renderer = "mathml"
html_copy_source = False
html_search_scorer = str(Path(__file__).parent / "guides_first.js")
html_show_sphinx = False
html_extra_path = ["site"]
html_static_path = ["static"]
html_css_files = ["site.css"]


def add_contents(app: Any, docname: str, source: list[str]) -> None:
    """Make a table of contents of the links that each section of the index lists."""
    if docname != root_doc:
        return
    for section in source[0].split("\n## ")[1:]:
        caption = section.splitlines()[0]
        links = re.findall(r"^- \*\*\[(.+?)\]\((\S+?)\.(?:md|py)\)", section, re.MULTILINE)
        entries = "\n".join(f"{title} <{page}>" for title, page in links)
        source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{entries}\n```\n"


def leave_folders(app: Any, doctree: nodes.document) -> None:
    """Show a link to a folder of the repository as text: the site has no page of it."""
    folder = Path(app.env.doc2path(app.env.docname)).parent
    for node in list(doctree.findall(addnodes.pending_xref)):
        if (folder / node["reftarget"]).is_dir():
            node.replace_self(node.children)


def read_markdown(app: Any, what: str, name: str, it: Any, options: Any, lines: list[str]) -> None:
    """Turn a docstring's Markdown, Gymnasium's custom, into reST; |x| stays the size of x."""
    out: list[str] = []
    for line in lines:
        if not line.startswith("|"):
            line = re.sub(r"^## (.+)", r"**\1**", line)
            out.append(re.sub(r"\|(\w+)\|", r"\|\1\|", line))
        elif set(line) <= set("|-: "):
            continue
        else:
            if not out or not out[-1].startswith("     - "):
                out += ["", ".. list-table::", "   :header-rows: 1", ""]
            first, *rest = (cell.strip() for cell in line.strip()[1:-1].split("|"))
            out += [f"   * - {first}", *(f"     - {cell}" for cell in rest)]
    lines[:] = out


def mathml(translator: Any, node: nodes.Element) -> None:
    """Write a formula as MathML, which browsers show without a script from elsewhere."""
    formula = node.astext()
    try:
        translator.body.append(tex2mathml(formula, as_block=isinstance(node, nodes.math_block)))
    except MathError as error:
        logger.warning("%s in the formula %s", error, formula, location=node)
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("source-read", add_contents)
    app.connect("doctree-read", leave_folders)
    app.connect("autodoc-process-docstring", read_markdown)
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
