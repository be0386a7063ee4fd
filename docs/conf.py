"""Settings of Sphinx, which makes the site of these pages: ./run docs."""

import re

import rosslt

project = 'rosslt'
author = copyright = 'The rosslt developers'  # noqa: A001 (Sphinx's name)
release = rosslt.__version__
extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
html_theme = 'sphinx_rtd_theme'
html_show_sphinx = False
myst_heading_anchors = 3
nitpicky = False
autodoc_default_options = {'show-inheritance': True}
autodoc_member_order = 'bysource'
napoleon_google_docstring = True
napoleon_numpy_docstring = False


def setup(app):
    """Have Sphinx read `code` in docstrings as people do: as code."""
    app.connect('autodoc-process-docstring', _mark_code, priority=400)  # before napoleon looks for colons


def _mark_code(app, what, name, obj, options, lines):
    lines[:] = [re.sub(r'(?<![`:])`([^`]+)`(?!`)', r'``\1``', line) for line in lines]
