"""What the build of the documentation does with tutorials."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

from kankaku.controllers.registry import OPERATIONS, PROTECTIONS


def forget_layers(*_: object) -> None:
    """Forget the protections and operations that a tutorial has registered."""
    for registry in (PROTECTIONS, OPERATIONS):
        for name in list(registry.added()):
            del registry[name]


def show_figure(_block: object, found: Mapping[str, Any], chosen: Mapping[str, Any]) -> str:
    """
    Show what a block of a tutorial has called ``figure``.

    Parameters
    ----------
    found
        What the block has left, and where images go.
    chosen
        How the tutorials are built.

    Returns
    -------
    str
        The image in reStructuredText; empty if there is none.
    """
    figure = found["example_globals"].pop("figure", None)
    if not isinstance(figure, Figure):
        return ""
    place = next(found["image_path_iterator"])
    figure.savefig(place, dpi=90)
    text: str = figure_rst([place], chosen["src_dir"])
    return text
