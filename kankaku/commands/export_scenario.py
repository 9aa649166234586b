"""What the command ``export`` writes of a scenario: files of its own, without any results."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from kankaku.analysis.asked_results import known_name
from kankaku.analysis.exports.gtfs_feed import feed_archive
from kankaku.analysis.tables.columns import write_whole
from kankaku.commands.export_shown import EXPORTED, ExportWish, refuse_day_and_zone
from kankaku.commands.screen import refusals, show_warnings
from kankaku.commands.shared_options import OUT
from kankaku.commands.told_tables import path_line
from kankaku.scenarios.exporting.gtfs_scenario import timetable_feed
from kankaku.scenarios.exporting.railjson_scenario import railjson_of
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of


def export_scenario(scenario: Path, to: str, out: Path | None, asked: ExportWish) -> int:
    """
    Write a scenario in the format of another program.

    Parameters
    ----------
    scenario
        Its folder, or the name of a shipped one.
    to
        One of ``SCENARIO_FORMATS``.
    out
        Where the files go; if None a folder in the scenario's, for a shipped one in ``out``.
    asked
        What only some formats need.

    Returns
    -------
    int
        How the command ends.
    """
    named = not os.path.lexists(scenario)
    # Nothing is written into the program's own folders.
    place = out or (OUT if named else scenario) / EXPORTED / to
    with refusals(scenario, place):
        known_name("format", to, list(SCENARIO_FORMATS))
        files = SCENARIO_FORMATS[to](folder_of(scenario), place, asked)
        for file in files:
            path_line("Written", file)
    return 0


def _gtfs(folder: Path, place: Path, asked: ExportWish) -> Iterator[Path]:
    refuse_day_and_zone(asked)
    scenario = load(folder)
    feed = timetable_feed(scenario, asked.timezone, asked.day)
    show_warnings([f"train {train} has no two calls: left out" for train in feed.left_out])
    place.mkdir(parents=True, exist_ok=True)
    file = place / f"{scenario.name}.gtfs.zip"
    write_whole(file, feed_archive(feed.tables))
    yield file


def _railjson(folder: Path, place: Path, _: ExportWish) -> Iterator[Path]:
    scenario = load(folder)
    place.mkdir(parents=True, exist_ok=True)
    file = place / f"{scenario.name}.railjson.json"
    text = json.dumps(railjson_of(scenario), ensure_ascii=False, indent=1)
    write_whole(file, f"{text}\n".encode())
    yield file


SCENARIO_FORMATS: Mapping[str, Callable[[Path, Path, ExportWish], Iterator[Path]]] = {
    "gtfs": _gtfs,
    "railjson": _railjson,
}
"""What scenarios can be written as: folder, place and wish to the files that are written."""
