"""How a page says that it wants to be cited: the program, and the paper of each method."""

from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

TITLE: Final = "Kankaku: a microscopic simulator of metropolitan railway lines on Eclipse SUMO"
PAPERS: Final[Mapping[str, str]] = {
    "two_stage": "Sato, Fukuda, Takahashi, Nakamura: Proposal and Evaluation of a Two-Stage "
    "Deceleration Algorithm for Inter-Station Stop Suppression, 2025",
    "approach_point": "Sakai, Ohnishi, Koseki, Tanaka, Morita, Tokuhara, Kasai: Numerical "
    "evaluation of a train control method to mitigate delay propagation based on "
    "communication-based continuous train position, 2020",
    "control_map": "Sugiyama, Iwata, Yamamoto: Basic Study on Train Control System Integrating "
    "Operational Control and Security Control, RTRI Report, 2018",
    "atd": "Takaoka, Noumi, Kawashima, Tashiro: High Speed and High Density Train Operation in "
    "Railway Systems, Hitachi Hyoron, 1991",
}
"""By the layer of a controller; ``CITATION.cff`` has the same."""


def citation(layers: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """
    Return how to cite a study.

    Parameters
    ----------
    layers
        What its controllers are made of.

    Returns
    -------
    dict[str, Any]
        ``text`` and ``bibtex`` of the program, ``papers`` of the methods.
    """
    used = {str(one.get(part, "")) for one in layers for part in ("protection", "operation")}
    papers = [paper for name, paper in PAPERS.items() if any(one.startswith(name) for one in used)]
    try:
        number = version("kankaku")
    except PackageNotFoundError:
        number = ""
    return {
        "text": f"The Kankaku authors: {TITLE}, version {number}.",
        "bibtex": (
            "@software{kankaku,\n"
            "  author = {{The Kankaku authors}},\n"
            f"  title = {{{TITLE}}},\n"
            f"  version = {{{number}}}\n"
            "}"
        ),
        "papers": papers,
    }
