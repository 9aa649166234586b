"""The busiest hour of a timetable, its most frequent pattern, and the train that stands for it."""

from collections.abc import Sequence

import pytest

from kankaku.railway.plan.pattern import BusiestHour, busiest_hour, peak_pattern, total_dwell_s
from kankaku.railway.plan.timetable import Call, Service, Timetable

HOUR_S = 3600.0
PLACES = {"west": ("w", 0.0), "mid": ("m", 2000.0), "east": ("e", 4000.0)}


def train(
    name: str,
    ends_s: float,
    dwell_s: float = 30.0,
    stations: Sequence[str] = ("west", "mid", "east"),
    kind: str = "local",
) -> Service:
    """A train that arrives at its last call at some time; it gets ready for ten minutes."""
    calls = []
    for number, station in enumerate(stations):
        track, stop_m = PLACES[station]
        arrival_s = ends_s - 200.0 * (len(stations) - 1 - number)
        stay_s = dwell_s if number else 600.0
        calls.append(Call(station, track, stop_m, arrival_s, arrival_s + stay_s, 20.0))
    return Service(name, stations[0], kind, ("main",), tuple(calls))


def test_the_busiest_hour_holds_the_most_last_arrivals_and_not_a_minute_more() -> None:
    ends_s = [0.0, 2000.0, 2500.0, 3000.0, 3600.0, 9000.0, 9100.0]
    timetable = Timetable(tuple(train(f"t{end_s:g}", end_s) for end_s in ends_s))
    # From 2000 s on there are four; from 0 on, too, because that at 3600 s is an hour later.
    assert busiest_hour(timetable) == BusiestHour(0.0, (0, 1, 2, 3))
    without_the_first = Timetable(timetable.services[1:])
    assert busiest_hour(without_the_first) == BusiestHour(2000.0, (0, 1, 2, 3))


def test_the_pattern_is_that_of_most_trains_of_the_peak_and_not_of_the_first_train() -> None:
    services = (
        train("early", 0.0, 95.0),
        train("express", 10_000.0, stations=("west", "east")),
        train("p1", 10_100.0, 70.0),
        train("p2", 10_200.0, 85.0),
        train("p3", 10_300.0, 80.0),
        train("freight", 10_400.0, kind="freight"),
        train("late", 20_000.0, 10.0),
    )
    found = peak_pattern(Timetable(services))
    assert found is not None
    assert found.hour.rows == (1, 2, 3, 4, 5)
    assert found.rows == (2, 3, 4)
    # Dwells of 140, 170 and 160 s behind the first station: the median is that of p3.
    assert services[found.row].train == "p3"
    assert total_dwell_s(services[found.row]) == 160.0


@pytest.mark.parametrize(
    ("dwells_s", "stands_for_all"),
    [([50.0, 40.0, 30.0, 20.0], 2), ([30.0, 30.0], 0), ([60.0, 30.0, 60.0], 0), ([40.0], 0)],
)
def test_of_two_medians_the_lower_counts_and_of_equals_the_first_train(
    dwells_s: Sequence[float], stands_for_all: int
) -> None:
    services = [train(f"t{place}", 60.0 * place, stay) for place, stay in enumerate(dwells_s)]
    found = peak_pattern(Timetable(tuple(services)))
    assert found is not None
    assert found.row == stands_for_all


def test_of_equally_frequent_patterns_the_one_with_more_calls_counts() -> None:
    services = (train("fast", 0.0, stations=("west", "east")), train("slow", 10.0))
    found = peak_pattern(Timetable(services))
    assert found is not None
    assert found.row == 1


def test_trains_that_call_only_once_make_no_pattern() -> None:
    once = [train(f"once{place}", 10.0 * place, stations=("east",)) for place in range(3)]
    assert peak_pattern(Timetable(tuple(once))) is None
    twice = train("twice", 50_000.0, stations=("mid", "east"))
    found = peak_pattern(Timetable((*once, twice)))
    assert found is not None
    assert (found.hour.rows, found.row) == ((3,), 3)


def test_trains_that_arrive_at_one_moment_all_count() -> None:
    services = tuple(train(f"t{place}", 500.0) for place in range(3))
    assert busiest_hour(Timetable(services)) == BusiestHour(500.0, (0, 1, 2))
