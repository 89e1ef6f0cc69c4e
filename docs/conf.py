"""How the documentation is built; see the `docs` target of the Makefile."""

import json
from importlib.metadata import version as installed_version
from os import environ
from pathlib import Path

from docutils import nodes
from sphinx.util.docutils import ReferenceRole

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

# Recordings of others do not come with the package; pages on them are made where these are.
_recorded = "" if "UNCONSTRAIN_DATA" in environ else "|plot_recorded_"
sphinx_gallery_conf = {
    "ignore_pattern": rf"__init__\.py{_recorded}",
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
html_extra_path = ["results"]
html_css_files = ["custom.css"]
html_show_sourcelink = False
# Pages without pages below them need no list of these.
_flat = [
    "architecture",
    "coming_from",
    "deploying",
    "experiments",
    "extending",
    "faq",
    "from_zero",
    "glossary",
    "how_it_works",
    "install",
    "look_and_play",
    "robust",
    "scaling",
    "which_learner",
    "your_own_data",
]
html_sidebars: dict[str, list[str]] = {page: [] for page in _flat}
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
}


class Measured(ReferenceRole):
    """A figure, as a link to the run that it is from; ``make numbers`` holds it to what that found."""

    def run(self):
        run, _, name = self.target.partition(" ")
        said = json.loads((Path(__file__).parent / "results" / f"{run}.json").read_text("utf-8"))
        node = nodes.reference(self.rawtext, self.title, refuri=f"{run}.json", internal=True, classes=["measured"])
        node["reftitle"] = f"{' '.join(name.split())}. {said['command']}, {said['date']}"
        return [node], []


def setup(app):
    """Know measured figures; write the pages that run by themselves beside those of the documentation."""
    app.add_role("measured", Measured())
    app.connect("build-finished", _write_pages)


def _write_pages(app, exception):
    if exception is not None or app.builder.name != "html":
        return
    import numpy as np

    import unconstrain as uc
    from unconstrain.pages.look import look_page
    from unconstrain.pages.play import play_page
    from unconstrain.paper.systems import wiping

    strokes = wiping.Strokes(count=2, duration=4.0)
    demos = [wiping.demonstrate(plate, np.random.default_rng(0), strokes=strokes) for plate in wiping.PLATES]
    policy = uc.LocallyLinearPolicy().fit_demonstrations(demos)
    shown = look_page(demos, ("x", "y", "z"), "Wiping", units=dict.fromkeys("xyz", "m"), policy=policy)
    for name, page in (("play", play_page()), ("look", shown)):
        (Path(app.outdir) / f"{name}.html").write_text(page, "utf-8")
