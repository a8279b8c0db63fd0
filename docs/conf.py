"""The site of the documentation: `sphinx-build -W -b html docs build/docs`.

SOGJAX_NOTEBOOKS names a folder of executed copies of the notebooks; without it they are shown without results.
"""

import os
import shutil
from pathlib import Path

from sogjax import __version__

project = "sogjax"
release = __version__
extensions = ["myst_nb", "sphinx.ext.apidoc", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
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
nb_execution_mode = "off"
nb_output_stderr = "remove"  # progress lines
suppress_warnings = ["ref.python"]  # one field name in two classes, met in an annotation

_place = Path(__file__).parent
shutil.rmtree(_place / "notebooks", ignore_errors=True)
shutil.copytree(
    os.environ.get("SOGJAX_NOTEBOOKS") or _place.parent / "notebooks",
    _place / "notebooks",
    ignore=lambda _, names: [name for name in names if not name.endswith(".ipynb")],
)
