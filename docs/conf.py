"""How the documentation is built; see the `docs` target of the Makefile."""

from importlib.metadata import version as installed_version

project = "unconstrain"
author = "The unconstrain authors"
copyright = "2026, The unconstrain authors"
release = installed_version("unconstrain")
version = ".".join(release.split(".")[:2])

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]

exclude_patterns = ["_build", "**/sg_execution_times.rst"]
default_role = "code"
math_number_all = False
math_eqref_format = "({number})"

autosummary_generate = True
autodoc_typehints = "none"  # numpydoc says shapes, which says more
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "auto_examples",
    "filename_pattern": r"\.py$",
    "backreferences_dir": None,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,
}

html_theme = "pydata_sphinx_theme"
html_title = "unconstrain"
html_static_path = ["_static"]
html_css_files = ["custom.css"]
html_show_sourcelink = False
# Pages without pages below them need no list of these.
_flat = ["architecture", "deploying", "experiments", "extending", "how_it_works", "robust", "scaling", "your_own_data"]
html_sidebars: dict[str, list[str]] = {page: [] for page in _flat}
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
}
