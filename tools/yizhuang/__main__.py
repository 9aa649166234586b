"""
``python -m tools.yizhuang`` writes the tables of the scenario anew, or checks them.

``--source CN_Songjiazhuang_Yizhuang.json`` of TTOBench gives stations, limits and gradients;
without it those that are there are taken.
"""

import argparse
import csv
import io
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tools.yizhuang.driving import driven_speed_table
from tools.yizhuang.line import Rows, SourceError, read_ttobench, source_tables, wayside_tables
from tools.yizhuang.timetable import leg_times, timetable_tables

FOLDER = Path(__file__).parents[2] / "scenarios" / "yizhuang"
EXIT_DIFFERS = 1
EXIT_BAD_INPUT = 2


def line_texts(folder: Path, source: Path | None) -> dict[str, str]:
    """
    Return the tables of the line.

    Parameters
    ----------
    folder
        Folder of the scenario.
    source
        The track of TTOBench; without it stations, limits and gradients stay as they are.

    Returns
    -------
    dict[str, str]
        Text by file.
    """
    if source is not None:
        told = read_ttobench(source)
        return _texts(source_tables(told)) | _texts(wayside_tables(told.stops_m))
    with (folder / "stations.csv").open(encoding="utf-8", newline="") as file:
        stops_m = [1000.0 * float(row["chainage_km"]) for row in csv.DictReader(file)]
    return _texts(wayside_tables(stops_m))


def timetable_texts(folder: Path) -> dict[str, str]:
    """
    Return the tables of the timetable, and the speeds that it asks for.

    Parameters
    ----------
    folder
        Folder of the scenario with the tables of the line.

    Returns
    -------
    dict[str, str]
        Text by file.
    """
    times = leg_times(folder)
    speeds = {"driven_speeds.csv": driven_speed_table(folder, times)}
    return _texts(timetable_tables(times) | speeds)


def _texts(tables: Mapping[str, Rows]) -> dict[str, str]:
    found = {}
    for name, rows in tables.items():
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows(rows)
        found[name] = text.getvalue()
    return found


def differing(folder: Path, texts: Mapping[str, str]) -> list[str]:
    """
    Return the files that are not as they would be written.

    Parameters
    ----------
    folder
        Folder of the scenario.
    texts
        Text by file.

    Returns
    -------
    list[str]
        Their names.
    """
    return [
        name
        for name, text in texts.items()
        if not (folder / name).exists() or (folder / name).read_text(encoding="utf-8") != text
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Write or check the tables as the command line says, and show the run times.

    Parameters
    ----------
    arguments
        Those of the command line; of this process if None.

    Returns
    -------
    int
        Exit status.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.yizhuang", description=__doc__)
    parser.add_argument("--source", type=Path, help="track file of TTOBench")
    parser.add_argument("--check", action="store_true", help="check the tables that are there")
    options = parser.parse_args(arguments)
    try:
        texts = line_texts(FOLDER, options.source)
    except (OSError, SourceError) as error:
        sys.stderr.write(f"{error}\n")
        return EXIT_BAD_INPUT
    if options.check:
        lost = differing(FOLDER, texts) or differing(FOLDER, timetable_texts(FOLDER))
        for name in lost:
            sys.stderr.write(f"{FOLDER / name} is not what would be written\n")
        return EXIT_DIFFERS if lost else 0
    _write(texts)
    _write(timetable_texts(FOLDER))
    for (start, end), leg in leg_times(FOLDER).items():
        interval = "-" if leg.interval_s is None else f"{leg.interval_s:.0f}"
        share = leg.run_s / leg.fastest_s
        figures = f"{interval:>5}{leg.fastest_s:8.1f}{leg.run_s:6d}{share:7.3f}"
        sys.stdout.write(f"{start:>20} {end:<26}{figures}\n")
    return 0


def _write(texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        (FOLDER / name).write_text(text, encoding="utf-8", newline="")


if __name__ == "__main__":
    sys.exit(main())
