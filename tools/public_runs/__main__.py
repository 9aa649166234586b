"""``python -m tools.public_runs`` means public intervals, and books dwells from them."""

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

from kankaku.scenarios.loading.public_timetable import read_source
from kankaku.scenarios.reading.units import clock_of
from tools.public_runs.dwells import peak_excesses, shares_of_peak, write_dwells
from tools.public_runs.intervals import (
    day_periods,
    mean_intervals,
    read_intervals,
    read_trains,
    write_intervals,
)
from tools.public_runs.quiet import quiet_legs, read_quiet, write_quiet, write_speeds

SCENARIOS = Path(__file__).parents[2] / "scenarios"
INTERVALS_FILE = "public_intervals.csv"
DWELLS_FILE = "dwell_stations.csv"
QUIET_FILE = "quiet_runs.csv"
SPEEDS_FILE = "driven_speeds.csv"


def write_means(public: Path, folder: Path, target: Path) -> None:
    """
    Write the mean intervals of the stations of a scenario, and tell their sums.

    Parameters
    ----------
    public
        Public timetable of both directions.
    folder
        Folder of the scenario, with ``stations.csv``; the last station's trains are the peak.
    target
        The file.
    """
    with (folder / "stations.csv").open(encoding="utf-8", newline="") as file:
        stations = [row["id"] for row in csv.DictReader(file)]
    periods = day_periods(stations[-1])
    intervals = mean_intervals(read_trains(public), stations, periods)
    write_intervals(intervals, target)
    for period in periods:
        rows = [
            row
            for row in intervals
            if (row.direction, row.period) == (period.direction, period.name)
        ]
        total_s, least = sum(row.mean_s for row in rows), min(row.trains for row in rows)
        told = f"{total_s:.0f} s over {len(rows)} legs, {least} trains or more"
        sys.stdout.write(f"{period.direction} {period.name:6}  {told}\n")


def write_table(folder: Path, target: Path) -> None:
    """
    Write the dwells by time of day of a scenario, and tell what they are made of.

    Parameters
    ----------
    folder
        Folder of the scenario, with public intervals and the factors on the delays.
    target
        The file.
    """
    intervals = read_intervals(folder / INTERVALS_FILE)
    quiet = read_quiet(folder / QUIET_FILE)
    write_dwells(intervals, quiet, folder / DWELLS_FILE, target)
    for excess in peak_excesses(intervals):
        errors = f"{excess.raw_s:6.1f} +- {excess.standard_error_s:4.1f} s"
        told = f"{errors}, smoothed {excess.smoothed_s:5.1f} s"
        sys.stdout.write(f"{excess.station:20} peak less quiet {told}\n")
    for share in shares_of_peak(intervals):
        told = f"{share.raw:5.2f} +- {share.standard_error:.2f}, smoothed {share.smoothed:5.2f}"
        sys.stdout.write(f"{clock_of(60 * share.start_min)[:5]} {told} of the peak\n")


def write_normal(folder: Path, target: Path) -> None:
    """
    Write normal runs and quiet dwells of a scenario, and what its trains are driven at.

    Parameters
    ----------
    folder
        Folder of the scenario, with public intervals and a driving style; ``driven_speeds.csv``
        is written there.
    target
        File of the runs.
    """
    source = read_source(folder)
    (train_type,) = source.train_types.values()
    intervals = read_intervals(folder / INTERVALS_FILE)
    legs = quiet_legs(intervals, (source.line, train_type, source.driving))
    write_quiet(legs, target)
    write_speeds(legs, source.line, folder / SPEEDS_FILE)
    for leg in legs:
        parts = f"{leg.run_s:5.1f} s at {leg.speed_kmh} km/h and {leg.dwell_s} s"
        public = f"public {leg.public_s:5.1f} +- {leg.standard_error_s:4.1f} s"
        told = f"{parts}, {public}: {leg.residual_s:+5.1f} s"
        sys.stdout.write(f"{leg.direction} to {leg.to_station:20} {told}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Write a table as the command line says.

    Parameters
    ----------
    arguments
        Those of the command line; of this process if None.

    Returns
    -------
    int
        Exit status.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.public_runs", description=__doc__)
    parser.add_argument("table", choices=("intervals", "normal", "dwells"))
    parser.add_argument("target", type=Path, help="file to write")
    parser.add_argument("--folder", type=Path, default=SCENARIOS / "rush_hour", help="scenario")
    parser.add_argument(
        "--public",
        type=Path,
        default=SCENARIOS / "whole_line" / "public_timetable.csv",
        help="public timetable of both directions",
    )
    options = parser.parse_args(arguments)
    if options.table == "intervals":
        write_means(options.public, options.folder, options.target)
    elif options.table == "normal":
        write_normal(options.folder, options.target)
    else:
        write_table(options.folder, options.target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
