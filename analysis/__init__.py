"""
From the record of a run to tables, sentences, figures and a folder of results.

It promises that the same record gives the same bytes, and that every column is declared once, with
unit and meaning. It relies on nothing but the vocabulary of :mod:`kankaku.railway`: it knows no
controller, no file format of scenarios and no SUMO.

``publish`` writes what ``figures`` draws and ``texts`` tells of ``tables``; ``words`` says how
names and times are told. An import goes down this order only.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kankaku.analysis.explaining import explain as explain

__all__ = ["explain"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has that name
    """Return the one question that notebooks ask; its modules are read when it is asked."""
    if name != "explain":
        msg = f"module 'kankaku.analysis' has no attribute {name!r}"
        raise AttributeError(msg)
    return import_module("kankaku.analysis.explaining").explain
