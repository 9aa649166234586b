"""``python -m tools.whole_line`` writes the tables of the scenario anew, or checks them."""

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

from kankaku.scenarios.loading.load_stock import read_stock, to_train_types
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.units import clock_of
from tools.csv_files import write_rows
from tools.whole_line.check import check_folder
from tools.whole_line.layout import Layout, build_layout, layout_tables
from tools.whole_line.runs import Usual, fastest_runs, usual_figures
from tools.whole_line.times import Day, solve_times
from tools.whole_line.trips import Trip, plan_platforms, read_trips

FOLDER = Path(__file__).parents[2] / "scenarios" / "whole_line"
STOCK = FOLDER.parent / "rush_hour"
TRAIN_TYPE = "e233-1000"


def read_layout(folder: Path) -> Layout:
    """
    Return the layout for the stations of a folder.

    Parameters
    ----------
    folder
        Folder of the scenario.

    Returns
    -------
    Layout
        The layout.
    """
    with (folder / "stations.csv").open(encoding="utf-8", newline="") as file:
        return build_layout({row["id"]: float(row["chainage_km"]) for row in csv.DictReader(file)})


def read_usual(folder: Path, layout: Layout, trips: Sequence[Trip]) -> Usual:
    """
    Return runs and dwells.

    Parameters
    ----------
    folder
        Folder of the scenario.
    layout
        The tracks.
    trips
        The trains.

    Returns
    -------
    Usual
        Runs and dwells.
    """
    stock = read_stock(Reader(), STOCK)
    if stock is None:
        msg = f"{STOCK} has no train types"
        raise ValueError(msg)
    with (folder / "dwell_stations.csv").open(encoding="utf-8", newline="") as file:
        dwells = {
            row["station"]: (int(row["minimum_dwell_s"]), int(row["booked_dwell_s"]))
            for row in csv.DictReader(file)
        }
    fastest = fastest_runs(folder, layout, to_train_types(stock)[TRAIN_TYPE])
    return usual_figures(trips, fastest, dwells)


def write_folder(folder: Path) -> None:
    """
    Write the tables of tracks and trains.

    Parameters
    ----------
    folder
        Folder of the scenario.
    """
    layout = read_layout(folder)
    trips = read_trips(folder)
    plan_platforms(trips, layout)
    times = solve_times(Day(trips, layout, read_usual(folder, layout, trips)))
    trips.sort(key=lambda trip: (times[trip.train][0][1], trip.train))
    tables = layout_tables(layout)
    tables["services.csv"] = [["train", "train_type", "next_train"]]
    tables["services.csv"] += [[trip.train, TRAIN_TYPE, trip.next_train] for trip in trips]
    tables["calls.csv"] = [["train", "station", "track", "arrival", "departure"]]
    for trip in trips:
        calls = zip(trip.stations, trip.tracks, times[trip.train], strict=True)
        tables["calls.csv"] += [
            [trip.train, station, track, *map(clock_of, clocks)] for station, track, clocks in calls
        ]
    for name, rows in tables.items():
        write_rows(folder / name, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Write or check the tables as the command line says.

    Parameters
    ----------
    arguments
        Those of the command line; of this process if None.

    Returns
    -------
    int
        Exit status.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.whole_line", description=__doc__)
    parser.add_argument("--check", action="store_true", help="check the tables that are there")
    if not parser.parse_args(arguments).check:
        write_folder(FOLDER)
    layout, trips = read_layout(FOLDER), read_trips(FOLDER)
    counts = check_folder(FOLDER, layout, trips, read_usual(FOLDER, layout, trips))
    for name, count in counts.items():
        sys.stdout.write(f"{count:6d}  {name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
