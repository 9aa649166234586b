"""The formats that can be imported, and what may be asked of them."""

from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from kankaku.railway.errors import KankakuError, suggesting
from kankaku.scenarios.drafts.draft import Draft, DraftError
from kankaku.scenarios.reading.cell_texts import printable


class SourceError(KankakuError):
    """
    A source that cannot be imported.

    Parameters
    ----------
    mistakes
        Everything that is wrong with it, a sentence each: file, row, what is wrong, what is
        allowed.
    """

    verdict = "cannot be imported"

    def __init__(self, mistakes: tuple[str, ...]) -> None:
        # Whatever a source holds, nobody's terminal is to obey it.
        self._mistakes = tuple(map(printable, mistakes))
        super().__init__("\n".join(self._mistakes))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return self._mistakes


@dataclass(frozen=True, slots=True)
class Wish:
    """What whoever imports asks for; a format says which of these it knows."""

    route: str = ""
    """Which line of the source."""
    day: str = ""
    """``YYYYMMDD``."""
    from_time: str = ""
    """``HH:MM:SS``: trains that begin earlier are left out."""
    until_time: str = ""
    """``HH:MM:SS``: trains that begin later are left out."""
    train: str = ""
    """Of the library of trains."""
    stock: Path | None = None
    """File of a train in the same format."""
    headway_s: float | None = None
    """Of trains where the source has no timetable. [s]"""
    trains: int | None = None
    """How many trains where the source has no timetable. [-]"""
    single_track: bool | None = None
    """Whether there is one track between stations; as the source suggests if nobody says."""


class SourceFormat(NamedTuple):
    """A format that can be imported."""

    name: str
    what: str
    """Of a source, in a few words."""
    module: str
    """With ``read(source, wish)``; imported when it is asked for."""
    asks: tuple[str, ...]
    """Fields of :class:`Wish` that it knows."""


_ROOM = "kankaku.scenarios.importing"
FORMATS: dict[str, SourceFormat] = {
    item.name: item
    for item in (
        SourceFormat(
            "gtfs",
            "a GTFS feed, as a folder or an archive",
            f"{_ROOM}.gtfs_import",
            ("route", "day", "from_time", "until_time", "train"),
        ),
        SourceFormat(
            "mini-tokyo-3d",
            "a train timetable of Mini Tokyo 3D, stations and railways beside it",
            f"{_ROOM}.mini_tokyo_import",
            ("route", "day", "from_time", "until_time", "train", "single_track"),
        ),
        SourceFormat(
            "osm",
            "an extract of OpenStreetMap, as .osm, .osm.xml or .osm.pbf",
            f"{_ROOM}.osm_import",
            ("route", "train", "headway_s", "trains", "single_track"),
        ),
        SourceFormat(
            "ttobench",
            "a track of TTOBench (JSON), with a train of it as stock",
            f"{_ROOM}.ttobench_import",
            ("train", "stock", "headway_s", "trains"),
        ),
        SourceFormat(
            "railjson",
            "an infrastructure in RailJSON, with rolling stock of it as stock",
            f"{_ROOM}.railjson_import",
            ("route", "train", "stock", "headway_s", "trains"),
        ),
        SourceFormat(
            "railsim",
            "network, schedule and vehicles of MATSim railsim, as a folder",
            f"{_ROOM}.railsim_import",
            ("route", "headway_s"),
        ),
    )
}


def imported(name: str, source: Path, wish: Wish) -> Draft:
    """
    Read a source.

    Parameters
    ----------
    name
        Of the format.
    source
        File or folder.
    wish
        What is asked for.

    Returns
    -------
    Draft
        The scenario, not written yet.

    Raises
    ------
    SourceError
        With everything that is wrong with the source.
    DraftError
        If there is no such format, it does not know what is asked for, or no scenario can be made.
    """
    if name not in FORMATS:
        raise DraftError(name, "no such format", suggesting(name, [*FORMATS], ", ".join(FORMATS)))
    found = FORMATS[name]
    nothing = Wish()
    for part in fields(Wish):
        asked = getattr(wish, part.name)
        if asked != getattr(nothing, part.name) and part.name not in found.asks:
            option = f"--{part.name.replace('_time', '').removesuffix('_s').replace('_', '-')}"
            known = ", ".join(found.asks)
            raise DraftError(option, f"{name} does not know it", known or "no option")
    draft: Draft = import_module(found.module).read(source, wish)
    return draft
