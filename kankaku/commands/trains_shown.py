"""What the command ``trains`` shows: the trains that a new line can begin with."""

import re
from collections.abc import Mapping
from typing import Any

from rich.markup import escape
from rich.table import Table

from kankaku.commands.screen import answers, complain
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import train_types_of
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.drafts.stock_library import LibraryTrain, library_names, library_train

LESS: Mapping[str, Any] = {
    "train": {"max_width": 20},
    "source": {"max_width": 15},
    "name": {"min_width": 14},
    "t": {"min_width": 4},
    "m": {"min_width": 5},
}
"""Widths in the list, so that it fits on any screen. [-]"""


def list_trains(name: str) -> int:
    """
    List the trains of the library, or tell all of one.

    Parameters
    ----------
    name
        Of a train; all if empty.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        trains = [library_train(known) for known in ([name] if name else library_names())]
    except KankakuError as error:
        complain(f"{name} cannot be shown", error.sentences)
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    for column in ("name", "train", "t", "m", "km/h", "start", "brake", "source"):
        table.add_column(column, no_wrap=True, **LESS.get(column, {"min_width": len(column)}))
    for train in trains:
        origin = re.split(r"[,:]", train.source)[0]
        table.add_row(*map(escape, (train.name, train.title, *_figures(train), origin)))
    answers.print(table)
    if name:
        (train,) = trains
        terms = f" ({train.terms})" if train.terms else ""
        answers.print(escape(f"Source: {train.source}{terms}."), soft_wrap=True)
        answers.print(escape(f"Assumed: {train.assumed or 'nothing'}."), soft_wrap=True)
    else:
        answers.print("start, brake: in m/s2 of the loaded train on the level.")
        answers.print("Where figures stand: kankaku trains NAME. Five figures make another one:")
        answers.print("kankaku new DIR --train-figures length_m=...", soft_wrap=True)
    return 0


def _figures(train: LibraryTrain) -> tuple[str, ...]:
    sketch = Sketch(train.name, SourceNotes(""), (), (), {train.name: train.entry})
    found = train_types_of(sketch)[train.name]
    inert_kg = found.mass_kg * (1.0 + found.rotating_mass_ratio)
    return (
        f"{found.mass_kg / 1000.0:g}",
        f"{found.length_m:g}",
        f"{3.6 * found.maximum_speed_mps:.0f}",
        f"{found.traction.starting_force_n / inert_kg:.2f}",
        f"{found.service_brake_mps2:.2f}",
    )
