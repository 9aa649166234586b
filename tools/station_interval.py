"""
From a departure to the next arrival at a busy station: ``make interval``.

At saturation that interval is what a protection, the train and its driver leave: the dwell does not
count. This asks blocking-time theory for it under each controller, lets two trains on SUMO check
it, and puts beside it what was measured on a line of Tokyo and what the timetable books.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from kankaku.studies import study
from kankaku.studies.capacity_study import assess_by_theory, pattern_of_peak
from kankaku.studies.two_trains import simulated_headway_s
from tools.paper_tables import markdown

PROJECT = Path(__file__).parents[1]
OUT = PROJECT / "out"
STATION = "akabane"
CONTROLLERS = ("close_up", "atd", "d_atc", "atc")
MEASURED_DWELL_S, MEASURED_HEADWAY_S = 54.0, 149.0
"""
Tozai line, Otemachi, 27 April 2015, 17 trains of ten 20 m cars at saturation. [s]

gendai.ismedia.jp/articles/-/43234
"""
BUSIEST = {"southbound": 22, "northbound": 24}
"""Trains of the busiest hour on the whole line."""
HOUR_S = 3600.0
HEADER = (
    "at Akabane",
    "departure to arrival [s]",
    "simulated [s]",
    "headway with 54 s of dwell [s]",
    "an hour",
)


class Interval(NamedTuple):
    """What lies between a departure and the next arrival at the station."""

    name: str
    theory_s: float
    simulated_s: float | None

    @property
    def cells(self) -> Sequence[str]:
        """A row of the table; simulated counts where there is such a figure."""
        interval_s = self.theory_s if self.simulated_s is None else self.simulated_s
        headway_s = interval_s + MEASURED_DWELL_S
        return (
            self.name,
            f"{self.theory_s:.1f}",
            "-" if self.simulated_s is None else f"{self.simulated_s:.1f}",
            f"{headway_s:.1f}",
            f"{HOUR_S / headway_s:.1f}",
        )


def of_controllers(chosen: study.Study) -> Iterator[Interval]:
    """
    Yield the interval under each controller.

    Parameters
    ----------
    chosen
        Scenario and controllers.

    Yields
    ------
    Interval
        In their order.
    """
    row = pattern_of_peak(chosen.scenario.timetable).row
    stations = [call.station for call in chosen.scenario.timetable.services[row].calls]
    call = stations.index(STATION)
    for spec in chosen.specs:
        found = assess_by_theory(chosen, spec)
        dwell_s = float(found.journey.departure_s[call] - found.journey.arrival_s[call])
        theory_s = found.headways[call - 1].headway_s
        simulated_s = simulated_headway_s(chosen, spec, (row, call), theory_s)
        yield Interval(f"`{spec.name}`", theory_s - dwell_s, simulated_s - dwell_s)


def booked(dwell_s: float) -> Iterator[Interval]:
    """
    Yield what the timetable leaves in its busiest hour.

    Parameters
    ----------
    dwell_s
        Booked at the station. [s]

    Yields
    ------
    Interval
        One for each direction.
    """
    for direction, trains in BUSIEST.items():
        name = f"booked {direction}, {trains} trains an hour, {dwell_s:.0f} s of dwell"
        yield Interval(name, HOUR_S / trains - dwell_s, None)


def main() -> None:
    """Print the table, and write it to ``out/station_interval.md``."""
    chosen = study.choose(PROJECT / "scenarios" / "rush_hour", names=CONTROLLERS)
    pattern = chosen.scenario.timetable.services[pattern_of_peak(chosen.scenario.timetable).row]
    call = next(call for call in pattern.calls if call.station == STATION)
    dwell_s = call.departure_s - call.arrival_s
    measured = Interval("measured at Otemachi", MEASURED_HEADWAY_S - MEASURED_DWELL_S, None)
    rows = [*of_controllers(chosen), measured, *booked(dwell_s)]
    table = markdown(HEADER, [row.cells for row in rows]) + "\n"
    OUT.mkdir(exist_ok=True)
    (OUT / "station_interval.md").write_text(table, encoding="utf-8")
    sys.stdout.write(f"Two trains of the pattern of {pattern.train}:\n\n{table}")


if __name__ == "__main__":
    main()
