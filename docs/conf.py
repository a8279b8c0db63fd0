"""The site of the documentation: `sphinx-build -W -b html docs build/docs`."""

from pathlib import Path

from sogjax import __version__

project = "sogjax"
release = __version__
extensions = ["myst_parser", "sphinx.ext.apidoc", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "sogjax"
default_role = "code"
apidoc_modules = [
    {
        "path": str(Path(__file__).parents[1] / "sogjax"),
        "destination": "api/",
        "module_first": True,
        "automodule_options": {"members"},
    }
]
autodoc_member_order = "bysource"
autodoc_default_options = {"ignore-module-all": True}  # each name once, where it is defined
suppress_warnings = ["ref.python"]  # one field name in two classes, met in an annotation
