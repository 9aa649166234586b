"""What the command ``export`` shows: the files that other programs read."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import NamedTuple
from zoneinfo import ZoneInfo

from kankaku.analysis.asked_results import NotInResultsError, known_name, read_asked
from kankaku.analysis.exports.fcd_file import fcd_lines
from kankaku.analysis.exports.gtfs_feed import GtfsNames, gtfs_feed
from kankaku.analysis.exports.railsim_columns import railsim_frame
from kankaku.analysis.exports.tidy_parquet import tidy_parquet
from kankaku.analysis.results import Results
from kankaku.analysis.tables.columns import write_whole
from kankaku.commands.screen import refusals, show_warnings
from kankaku.commands.told_tables import path_line
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RAW_TABLES
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.sumo_net.build import network
from kankaku.sumo_net.geometry import centre_line
from kankaku.sumo_net.names import safe

EXPORTED = "exported"
"""Folder for them in a results folder."""
_DAY = re.compile(r"([0-9]{4})([0-9]{2})([0-9]{2})")


class ExportWish(NamedTuple):
    """What the user wants of an export."""

    scenario: Path | None
    """Folder or name; that of the results if None."""
    timezone: str
    day: str


def export(
    folder: Path,
    to: str,
    out: Path | None,
    controllers: Sequence[str],
    seed: int | None,
    asked: ExportWish,
) -> int:
    """
    Write results in the format of another program.

    Parameters
    ----------
    folder
        Results folder.
    to
        One of ``FORMATS_OF_OTHERS``.
    out
        Where the files go; a folder in the results if None.
    controllers
        Of these; all if empty.
    seed
        Of which seed; the first one if None.
    asked
        What only some formats need.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(folder, out or folder):
        known_name("format", to, list(FORMATS_OF_OTHERS))
        found = read_asked(folder, controllers=controllers, seed=seed)
        show_warnings(found.notes)
        place = out or found.results.folder / EXPORTED / to
        place.mkdir(parents=True, exist_ok=True)
        for file in FORMATS_OF_OTHERS[to](found.results, place, asked):
            path_line("Written", file)
    return 0


def _railsim(results: Results, place: Path, _asked: ExportWish) -> Iterator[Path]:
    line = _line_name(results)
    for run in results.runs:
        file = place / f"{run.controller}.railsimTimeDistance.csv"
        write_whole(file, railsim_frame(run, line).to_csv(index=False, lineterminator="\n"))
        yield file


def _fcd(results: Results, place: Path, asked: ExportWish) -> Iterator[Path]:
    """Write what ``tools/fcdReplay.py`` of SUMO shows in sumo-gui."""
    line = _scenario(results, asked).line
    drawn = centre_line(line)
    net = place / "line.net.xml"
    write_whole(net, network(line).read_bytes())
    yield net
    for run in results.runs:
        file = place / f"{run.controller}.fcd.xml"
        write_whole(file, "".join(fcd_lines(run, drawn.at, safe)))
        yield file
    times_s = [
        moment
        for run in results.runs
        for moment in (run.trajectory["time_s"].min(), run.trajectory["time_s"].max())
    ]
    config = place / "replay.sumocfg"
    write_whole(config, REPLAY.format(begin=min(times_s), end=max(times_s)))
    yield config


REPLAY = """\
<configuration>
    <input><net-file value="line.net.xml"/></input>
    <time><begin value="{begin:.0f}"/><end value="{end:.0f}"/><step-length value="1"/></time>
</configuration>
"""
"""An empty simulation of the line, in which the places of the trains are shown."""


def _gtfs(results: Results, place: Path, asked: ExportWish) -> Iterator[Path]:
    scenario = _scenario(results, asked)
    refuse_day_and_zone(asked)
    stations = {station.id: station for station in scenario.line.stations}
    missing = [name for name in results.stations["station"] if name not in stations]
    if missing:
        where = f"scenario {scenario.name}"
        raise NotInResultsError(where, f"has no station {missing[0]!r}", "that of the results")
    names = GtfsNames(
        line=scenario.title,
        agency=scenario.name,
        timezone=asked.timezone,
        first_day=asked.day,
        places_deg={
            name: (station.longitude_deg, station.latitude_deg)
            for name, station in stations.items()
        },
        local_names={name: station.name_local for name, station in stations.items()},
    )
    for run in results.runs:
        feed = gtfs_feed(run, results.stations, names)
        show_warnings(
            [f"{run.controller}: train {train} reached no two stations" for train in feed.left_out]
        )
        file = place / f"{run.controller}.gtfs.zip"
        write_whole(file, feed.archive)
        yield file


def _parquet(results: Results, place: Path, _asked: ExportWish) -> Iterator[Path]:
    for table in RAW_TABLES:
        file = place / f"{table}.parquet"
        write_whole(file, tidy_parquet(results.runs, table))
        yield file


FORMATS_OF_OTHERS: Mapping[str, Callable[[Results, Path, ExportWish], Iterator[Path]]] = {
    "railsim": _railsim,
    "fcd": _fcd,
    "gtfs": _gtfs,
    "parquet": _parquet,
}
"""What results can be written as."""


def _line_name(results: Results) -> str:
    return str(results.provenance.get("scenario", "")) or results.folder.name


def _scenario(results: Results, asked: ExportWish) -> Scenario:
    """Return the scenario that was run; tell if it has been changed since."""
    chosen = asked.scenario or Path(_line_name(results))
    scenario = load(folder_of(chosen))
    if results.provenance.get("scenario_sha256") != scenario.digest:
        show_warnings([f"{results.folder}: of a scenario that has been changed since"])
    return scenario


def refuse_day_and_zone(asked: ExportWish) -> None:
    """
    Refuse a day or a time zone that there is not.

    Parameters
    ----------
    asked
        What the user wants.

    Raises
    ------
    NotInResultsError
        With what is wrong.
    """
    try:
        ZoneInfo(asked.timezone)
    except (ValueError, OSError) as error:
        where, told = "--timezone", f"there is no {asked.timezone[:60]!r}"
        raise NotInResultsError(where, told, "for example Asia/Tokyo") from error
    digits = _DAY.fullmatch(asked.day)
    try:
        known = digits and date(int(digits[1]), int(digits[2]), int(digits[3]))
    except ValueError:
        known = None
    if not known:
        where, told = "--day", f"{asked.day[:60]!r} is no day"
        raise NotInResultsError(where, told, "for example 20260314")
