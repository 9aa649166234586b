"""Observed dwells as files of a scenario: rows, settings, and what was assumed."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import tomlkit

from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.drafts.draft import DraftError, csv_text, write_files
from kankaku.scenarios.observing.dwell_statistics import (
    LEAST_OF_HOUR,
    LEAST_OF_STATION,
    MINIMUM_LEVEL,
    MOST_CORRELATION,
    DwellGroup,
    DwellStatistics,
)
from kankaku.scenarios.reading.dwell_rows import DwellRows
from kankaku.scenarios.reading.excel_sheets import ENDING
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.scenarios.reading.row_formats import CallRow, DwellStationRow, QuantileRow, StationRow
from kankaku.scenarios.reading.units import clock_of, whole_seconds

STATIONS_FILE, QUANTILES_FILE = "dwell_stations.csv", "dwell_quantiles.csv"
SETTINGS_FILE = "dwell_delays.toml"
NOTES_FILE = "DWELL_SOURCES.md"
TITLE = "Observed dwells"


class WrittenDwells(NamedTuple):
    """What was written of observed dwells."""

    files: tuple[str, ...]
    kept: tuple[str, ...]
    """Stations of the scenario that nobody observed, and whose rows stay."""
    shortened: tuple[str, ...] = ()
    """Stations whose trains are booked for less than the observed minimum dwell."""


def delay_settings(found: DwellStatistics) -> dict[str, Any]:
    """
    Return the table ``[dwell_delays]`` for observed dwells.

    Parameters
    ----------
    found
        The statistics.

    Returns
    -------
    dict[str, Any]
        Keys of ``scenario.toml``.
    """
    correlation = min(max(found.correlation.value, 0.0), MOST_CORRELATION)
    return {
        "folder": ".",
        "scale": 1.0,
        "cap_s": found.cap_s,
        "trip_correlation": round(correlation, 3),
    }


def quantile_rows(found: DwellStatistics) -> list[QuantileRow]:
    """
    Return the rows of ``dwell_quantiles.csv``.

    Parameters
    ----------
    found
        The statistics.

    Returns
    -------
    list[QuantileRow]
        By rising level.
    """
    return [QuantileRow(0, *pair) for pair in zip(found.levels, found.delays_s, strict=True)]


def station_rows(
    groups: Sequence[DwellGroup], names: Mapping[str, str] | None = None
) -> list[DwellStationRow]:
    """
    Return rows of ``dwell_stations.csv``.

    Parameters
    ----------
    groups
        Dwells by station and hour.
    names
        What a station is called in the scenario; those without a name are left out. Where nothing
        is given, every station keeps its own.

    Returns
    -------
    list[DwellStationRow]
        For every station a row that always holds, and one for each hour with enough dwells.
    """
    return [
        DwellStationRow(
            0,
            group.station if names is None else names[group.station],
            *(group.minimum_s, group.booked_s, group.delay_scale),
            *(
                ("", "")
                if group.hour is None
                else (clock_of(3600 * group.hour), clock_of(3600 * (group.hour + 1)))
            ),
        )
        for group in groups
        if names is None or group.station in names
    ]


def write_dwells(found: DwellStatistics, folder: Path, *, force: bool = False) -> WrittenDwells:
    """
    Write observed dwells into a folder of their own.

    Parameters
    ----------
    found
        The statistics.
    folder
        Made if missing.
    force
        Whether files may be replaced.

    Returns
    -------
    WrittenDwells
        What was written.

    Raises
    ------
    DraftError
        If a file is there already, or the folder cannot be written.
    """
    assume(found)
    files = {
        QUANTILES_FILE: csv_text(quantile_rows(found)),
        STATIONS_FILE: csv_text(station_rows(found.groups)),
        SETTINGS_FILE: tomlkit.dumps({"dwell_delays": delay_settings(found)}),
        NOTES_FILE: found.sample.notes.markdown(TITLE),
    }
    write_files(files, folder, force=force)
    return WrittenDwells((*files,), ())


def write_into_scenario(
    found: DwellStatistics, folder: Path, *, force: bool = False
) -> WrittenDwells:
    """
    Write observed dwells into a scenario, and let it draw its delays from them.

    Parameters
    ----------
    found
        The statistics.
    folder
        Folder of the scenario. Its stations are found by identifier or name.
    force
        Whether its dwells and its table ``[dwell_delays]`` may be replaced.

    Returns
    -------
    WrittenDwells
        What was written.

    Raises
    ------
    ScenarioError
        If its files cannot be read.
    DraftError
        If it has no station that was observed, its timetable is that of another scenario, or
        something would be replaced that may not.
    """
    main, stations, rows, calls = _read(folder)
    names = _matched(found, stations)
    notes = found.sample.notes
    kept = [row for row in rows if row.station not in names.values()]
    for station in (own for own in found.sample.names if own not in names):
        notes.miss(f"observed dwells at {station}", "no station of the scenario, or too few dwells")
    for station in dict.fromkeys(row.station for row in kept):
        why = "nobody observed that station, or too few trains there"
        notes.assume(f"dwells at {station}", "the rows that the scenario had", why)
    assume(found)
    own, shortened = _as_booked(station_rows(found.groups, names), calls)
    for name, less_s in shortened.items():
        value = f"up to {less_s:g} s less than observed"
        notes.assume(f"minimum dwell at {name}", value, "trains are booked there for no longer")
    files = {
        QUANTILES_FILE: csv_text(quantile_rows(found)),
        STATIONS_FILE: csv_text([*own, *kept]),
        NOTES_FILE: notes.markdown(TITLE),
    }
    settings, is_changed = _with_delays(main, delay_settings(found))
    if is_changed and not force:
        allowed = "a scenario without that table, or --force"
        place = f"{folder / MAIN_FILE}: dwell_delays"
        raise DraftError(place, "is there already", allowed)
    write_files(files, folder, force=force)
    write_files({MAIN_FILE: settings}, folder, force=True)
    unseen = tuple(dict.fromkeys(row.station for row in kept))
    return WrittenDwells((*files, MAIN_FILE), unseen, (*shortened,))


def _as_booked(
    rows: Sequence[DwellStationRow], calls: Sequence[CallRow]
) -> tuple[list[DwellStationRow], dict[str, float]]:
    """Return rows with no minimum dwell above a booked one, and how much less they have. [s]"""
    dwells = DwellRows(rows)
    least_s = {id(row): row.minimum_dwell_s for row in rows}
    for call in calls:
        went_s = whole_seconds(call.departure)
        row = dwells.find(call.station, "", went_s)
        if row is not None:
            stay_s = max(went_s - whole_seconds(call.arrival), 0)
            least_s[id(row)] = min(least_s[id(row)], float(stay_s))
    less_s: dict[str, float] = {}
    for row in rows:
        if least_s[id(row)] < row.minimum_dwell_s:
            beyond_s = row.minimum_dwell_s - least_s[id(row)]
            less_s[row.station] = max(less_s.get(row.station, 0.0), beyond_s)
    return [replace(row, minimum_dwell_s=least_s[id(row)]) for row in rows], less_s


def _read(folder: Path) -> tuple[str, list[StationRow], list[DwellStationRow], list[CallRow]]:
    """Return the text of the main file, the stations, the dwells and the calls of a scenario."""
    reader = Reader()
    data = reader.toml(folder / MAIN_FILE, "scenario") or {}
    timetable, line = (str(data.get(key, ".")) for key in ("timetable", "line"))
    if timetable != ".":
        place = f"{folder / MAIN_FILE}: timetable"
        allowed = "a scenario with a timetable of its own, or --out"
        raise DraftError(place, f"the dwells are those of {timetable!r}", allowed)
    for name in (STATIONS_FILE, QUANTILES_FILE):
        workbook = folder / name.replace(".csv", ENDING)
        if os.path.lexists(workbook):
            raise DraftError(str(workbook), f"stands in place of {name}", "no such file, or --out")
    stations = reader.csv(folder / line / "stations.csv", "line", StationRow)
    dwells = reader.csv(folder / STATIONS_FILE, "timetable", DwellStationRow, optional=True)
    calls = reader.csv(folder / "calls.csv", "timetable", CallRow)
    if reader.mistakes:
        raise ScenarioError(tuple(reader.mistakes))
    return (folder / MAIN_FILE).read_text("utf-8-sig"), [*stations], [*dwells], [*calls]


def _plain(name: str) -> str:
    return "".join(one for one in name.casefold() if one.isalnum())


def _matched(found: DwellStatistics, stations: Sequence[StationRow]) -> dict[str, str]:
    """Return stations of the scenario by observed ones, of those that have dwells."""
    by_name: dict[str, str] = {}
    for station in stations:
        for name in (station.id, station.name, station.name_local):
            if _plain(name):
                by_name.setdefault(_plain(name), station.id)
    observed = dict.fromkeys(group.station for group in found.groups)
    matched: dict[str, str] = {}
    for name in observed:
        own = by_name.get(_plain(name)) or by_name.get(_plain(found.sample.names[name]))
        if own and own not in matched.values():
            matched[name] = own
    if not matched:
        known = ", ".join(station.id for station in stations[:10])
        seen = ", ".join([*observed][:10])
        problem = f"no station of the scenario was observed; observed are {seen}"
        place, allowed = "stations.csv", f"identifiers or names such as {known}"
        raise DraftError(place, problem, allowed)
    return matched


def _with_delays(text: str, settings: Mapping[str, Any]) -> tuple[str, bool]:
    """Return the main file with other delays, and whether that replaces any it has."""
    document = tomlkit.parse(text)
    if "dwell_delays" not in document:
        made = tomlkit.table()
        made.update(settings)
        document["dwell_delays"] = made
        return tomlkit.dumps(document), False
    table: Any = document["dwell_delays"]
    is_changed = any(table.get(key) != value for key, value in settings.items())
    for key, value in settings.items():
        # A key that stays keeps the comment behind it.
        if table.get(key) != value:
            table[key] = value
    return tomlkit.dumps(document), is_changed


def assume(found: DwellStatistics) -> None:
    """
    Note what the statistics rest on.

    Parameters
    ----------
    found
        The statistics; their notes grow.
    """
    notes = found.sample.notes
    share = f"{MINIMUM_LEVEL:.0%}"
    notes.assume(
        "minimum dwell",
        f"what {share} of a station's dwells are shorter than, in whole seconds",
        "nobody observes what a train could not do without",
    )
    is_booked = any(dwell.booked_s is not None for dwell in found.sample.dwells)
    notes.assume(
        "booked dwell",
        f"the median of the {'booked' if is_booked else 'observed'} dwells of a station",
        "one figure for all its trains" if is_booked else "the source has no booked times",
    )
    notes.assume(
        "dwell delay",
        "dwell less the station's minimum, 0 where it is shorter",
        "what a scenario adds to the minimum dwell; the quantiles hold for a delay_scale of 1",
    )
    notes.assume(
        "delay_scale",
        "mean delay of a station over that of all",
        "stations differ by a factor; the form of the distribution is one for all",
    )
    notes.assume(
        "rows by time of day",
        f"an hour with {LEAST_OF_HOUR} dwells or more; otherwise all of the station, if these are "
        f"{LEAST_OF_STATION} or more",
        "fewer say little",
    )
    _assume_dependence(found)
    counts = [group.station for group in found.groups if group.hour is None]
    if few := [name for name in found.sample.names if name not in counts]:
        notes.miss(f"dwells at {', '.join(few)}", f"fewer than {LEAST_OF_STATION} were left")


def _assume_dependence(found: DwellStatistics) -> None:
    """Note what is said of how dwells hang together."""
    notes, one = found.sample.notes, found.correlation
    told = f"{one.value:.2f}, from {one.low:.2f} to {one.high:.2f} with 95 %"
    why = f"normal scores of {one.pairs} pairs of successive stations of a train"
    if one.value < 0.0:
        why += "; a scenario has none below 0, and 0 was written"
    notes.assume("trip_correlation", told, why)
    notes.assume(
        "directions and train types",
        "all together",
        "rows of a scenario are by station; what directions differ by counts as trip_correlation",
    )
    for whole in found.headways[:1]:
        slope, error = 60.0 * whole.slope, 60.0 * whole.slope_error
        notes.miss(
            "dependence of dwells on the headway",
            "a scenario draws them independently of it; observed are "
            f"{slope:.1f} s for each minute (standard error {error:.1f}, {whole.dwells} dwells, "
            f"rank correlation {whole.rank_correlation:.2f})",
        )


def statistics_text(found: DwellStatistics) -> str:
    """
    Return the statistics by station and hour as a CSV file, for whoever wants to look.

    Parameters
    ----------
    found
        The statistics.

    Returns
    -------
    str
        With a header; dwells in seconds.
    """
    slopes = {one.station: one for one in found.headways if one.station}
    head = (
        "station,name,hour,dwells,p10_s,p25_s,p50_s,p75_s,p90_s,minimum_dwell_s,booked_dwell_s,"
        "delay_scale,headway_slope,headway_slope_error"
    )
    lines = []
    for group in found.groups:
        slope = slopes.get(group.station) if group.hour is None else None
        name = found.sample.names[group.station].replace('"', '""')
        cells = [
            *(group.station, f'"{name}"', "" if group.hour is None else str(group.hour)),
            str(group.dwells),
            *(f"{value:.1f}" for value in group.quantiles_s),
            *(f"{group.minimum_s:g}", f"{group.booked_s:g}", f"{group.delay_scale:g}"),
            *((f"{slope.slope:.4f}", f"{slope.slope_error:.4f}") if slope else ("", "")),
        ]
        lines.append(",".join(cells))
    return "\n".join(chain([head], lines)) + "\n"
