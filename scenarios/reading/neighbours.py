"""Files beside those that are read: misspelt names are told, and memory is not searched in vain."""

import gc
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path

from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.reading.cell_texts import printable, shown
from kankaku.scenarios.reading.excel_sheets import ENDING
from kankaku.scenarios.reading.mistakes import Mistake

KNOWN = (
    MAIN_FILE,
    "rolling_stock.toml",
    "radio_network.toml",
    "availability.toml",
    "fault_tree.toml",
    "stations.csv",
    "tracks.csv",
    "platforms.csv",
    "turnouts.csv",
    "nodes.csv",
    "routes.csv",
    "crossings.csv",
    "driven_speeds.csv",
    "limits.csv",
    "gradients.csv",
    "curves.csv",
    "balises.csv",
    "blocks.csv",
    "circuits.csv",
    "geometry.csv",
    "services.csv",
    "calls.csv",
    "dwell_stations.csv",
    "dwell_quantiles.csv",
    "public_timetable.csv",
    "quiet_runs.csv",
    "public_intervals.csv",
)
"""Every file that a command reads from a scenario folder, or a tool made one of them from."""
_MADE_FROM = ("public_timetable.csv", "quiet_runs.csv", "public_intervals.csv")
"""What tools make other files from, and read by themselves."""
SHEETS = {
    name.replace(".csv", ENDING): name
    for name in KNOWN
    if name.endswith(".csv") and name not in _MADE_FROM
}
"""Excel files that may stand in place of CSV files, by name."""
MOST_TOLD = 8
"""Files of one folder. [-]"""
_QUANTILES = "dwell_quantiles.csv"


@contextmanager
def uncollected() -> Iterator[None]:
    """
    Let Python not look for circles of garbage.

    A million rows hold none, and the search takes longer than their reading.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def folder_mistakes(folder: Path) -> list[Mistake]:
    """
    Return what is wrong with the name of a scenario's folder, which results and reports bear.

    Parameters
    ----------
    folder
        The folder.

    Returns
    -------
    list[Mistake]
        At most one.
    """
    name = folder.resolve().name
    if name and name.isprintable():
        return []
    problem = f"the folder's name {shown(name)} cannot be written"
    return [Mistake(MAIN_FILE, "", problem, "a folder with a name of letters and digits")]


def unread(folders: Iterable[Path], *, has_delays: bool) -> tuple[str, ...]:
    """
    Return what lies in a scenario's folders and is not read although it looks like a file of it.

    Parameters
    ----------
    folders
        Folder of the scenario first, then those it names.
    has_delays
        Whether the scenario reads its measured dwell delays.

    Returns
    -------
    tuple[str, ...]
        A sentence each; notes, pictures and hidden files are nobody's business.
    """
    distinct = [Path(real) for real in dict.fromkeys(map(os.path.realpath, folders))]
    sentences = [sentence for folder in distinct for sentence in _unread_in(folder)]
    sentences += [
        f"{name} is not read: {MAIN_FILE} has no [dwell_delays]"
        for name in (_QUANTILES, _sibling(_QUANTILES))
        if not has_delays and (distinct[0] / name).exists()
    ]
    return tuple(sentences)


def _unread_in(folder: Path) -> list[str]:
    with os.scandir(folder) as entries:
        names = sorted(entry.name for entry in entries if not entry.is_dir())
    told = [sentence for name in names if (sentence := _sentence(name, names))]
    if len(told) > MOST_TOLD:
        more = f"{printable(folder.name)}: {len(told) - MOST_TOLD} more files are not read"
        told = [*told[:MOST_TOLD], more]
    return told


def _sentence(name: str, names: list[str]) -> str:
    # Excel puts a file of that kind beside one that it has open.
    if name in KNOWN or name in SHEETS or name.startswith((".", "~$")):
        return ""
    plain = name.casefold().replace(" ", "_").replace("-", "_")
    of_kind = SHEETS if plain.endswith(ENDING) else KNOWN
    likely = get_close_matches(plain, of_kind, n=1, cutoff=0.8)
    missing = [other for other in likely if not {other, _sibling(other)} & {*names}]
    if missing:
        return f"{shown(name)} is not read; did you mean {missing[0]}?"
    return f"{shown(name)} is not read" if plain.endswith((".csv", ".toml", ENDING)) else ""


def _sibling(name: str) -> str:
    """Return the file that may stand in place of another one."""
    return SHEETS.get(name) or name.replace(".csv", ENDING)
