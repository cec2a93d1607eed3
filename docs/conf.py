"""How the site is built: `make docs`. Nothing is fetched, neither now nor by its readers."""

import logging
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import latex2mathml.converter
from docutils import nodes

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import clarke_gym

project = "clarke_gym"
author = "The clarke_gym developers"
copyright = f"{author}; MIT licence"
release = version = clarke_gym.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["_build", "explorer"]
suppress_warnings = ["myst.header"]  # generated pages begin with headings of their own level

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_timeout = 400
os.environ.setdefault("OMP_NUM_THREADS", "1")  # small networks, and a machine may be busy
nb_execution_raise_on_error = True
nb_merge_streams = True
logging.getLogger("traitlets").setLevel(logging.WARNING)
# The kernel speaks to this process alone; what it says about that is no news for who builds.
os.environ["IPYTHONDIR"] = tempfile.mkdtemp()
_profile = Path(os.environ["IPYTHONDIR"]) / "profile_default"
_profile.mkdir()
(_profile / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 40\n")
copybutton_prompt_text = ">>> "
copybutton_exclude = ".linenos, .gp, .go"

napoleon_google_docstring = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings say shapes and units
autodoc_default_options = {"members": True, "show-inheritance": False}

html_theme = "furo"
html_title = "clarke_gym"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_favicon = "_static/icon.svg"
html_show_sphinx = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#005f94", "color-brand-content": "#005f94"},
    "dark_css_variables": {"color-brand-primary": "#6fc3f0", "color-brand-content": "#6fc3f0"},
}


def _math(translator, node):
    """Write a formula as MathML, which browsers draw themselves."""
    display = "block" if isinstance(node, nodes.math_block) else "inline"
    translator.body.append(latex2mathml.converter.convert(node.astext(), display=display))
    raise nodes.SkipNode


def _complete(app, docname, source):
    """Give generated tables a title, and leave out patterns that no page answers to yet."""
    text = source[0]
    if not re.search(r"^#+ ", text, re.MULTILINE) and "{include}" not in text:
        title = docname.removesuffix("/table").replace("/", ", ").replace("_", " ")
        text = f"# {title.capitalize()}\n\n{text}"
    for pattern in re.findall(r"^\w[\w/*]*\*$", text, re.MULTILINE):
        if not any(Path(app.srcdir).glob(f"{pattern}.md")):
            text = text.replace(f"\n{pattern}\n", "\n")
    source[0] = text


def _copy_explorer(app, error):
    if error is None and app.builder.name == "html":
        shutil.copytree(
            Path(app.srcdir) / "explorer",
            Path(app.outdir) / "explorer",
            ignore=shutil.ignore_patterns("node_modules", "package*.json", "*.entry.js", "*.mjs"),
            dirs_exist_ok=True,
        )


def setup(app):
    """Register the hooks above."""
    app.add_html_math_renderer("mathml", (_math, None), (_math, None))
    app.connect("source-read", _complete)
    app.connect("build-finished", _copy_explorer)
