"""Intervals of the public timetable by time of day, and the dwells that are booked from them."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.scenarios.loading.public_timetable import read_source
from kankaku.scenarios.shipped import folder_of
from kankaku.testing.example_lines import commuter_train, straight_line
from tools.driven_speeds import driven_s
from tools.public_runs.__main__ import main
from tools.public_runs.dwells import dwell_rows, peak_excesses, shares_of_peak
from tools.public_runs.intervals import (
    NORTHBOUND,
    QUIET,
    SOUTHBOUND,
    Interval,
    PublicTrain,
    day_periods,
    mean_and_error_s,
    mean_intervals,
    read_intervals,
)
from tools.public_runs.quiet import (
    QuietLeg,
    quiet_legs,
    read_quiet,
    write_quiet,
    write_speeds,
)

RUSH_HOUR = folder_of("rush_hour")


def means(intervals: list[Interval], direction: str, period: str) -> list[float]:
    return [row.mean_s for row in intervals if (row.direction, row.period) == (direction, period)]


def test_the_shipped_intervals_are_those_of_the_public_timetable(tmp_path: Path) -> None:
    assert main(["intervals", str(tmp_path / "again.csv")]) == 0
    again = (tmp_path / "again.csv").read_bytes()
    assert again == (RUSH_HOUR / "public_intervals.csv").read_bytes()


@pytest.mark.parametrize(
    ("period", "total_s"), [("early", 2171), ("late", 2197), ("midday", 2233), ("peak", 2359)]
)
def test_trains_need_longer_the_busier_they_are(period: str, total_s: float) -> None:
    found = means(read_intervals(RUSH_HOUR / "public_intervals.csv"), "southbound", period)
    assert len(found) == 14
    assert sum(found) == pytest.approx(total_s, abs=1.0)


def test_truncation_cancels_in_the_mean() -> None:
    rng = np.random.default_rng(3)
    trains = []
    for number in range(4000):
        start_s = int(rng.integers(4 * 3600, 5 * 3600))
        departures = {"a": start_s // 60, "b": (start_s + 137) // 60}
        trains.append(PublicTrain(f"T{number}", "southbound", departures))
    early = mean_intervals(trains, ("a", "b"), day_periods("b"))[0]
    assert (early.period, early.trains) == ("early", 4000)
    assert abs(early.mean_s - 137.0) < 3.0 * early.standard_error_s
    # Of two and three minutes, mixed as 137 s asks for.
    assert early.standard_error_s == pytest.approx(
        60.0 * (43 * 17) ** 0.5 / 60 / 4000**0.5, rel=0.02
    )


def test_a_few_equal_minutes_are_not_certain() -> None:
    assert mean_and_error_s([2] * 8) == pytest.approx((120.0, 6.0))
    assert mean_and_error_s([2]) == pytest.approx((120.0, 20.0))


def test_a_passed_station_is_no_end_of_an_interval_and_directions_are_apart() -> None:
    trains = [
        PublicTrain("A", "southbound", {"a": 300, "b": 302, "c": 305}),
        PublicTrain("B", "southbound", {"a": 310, "c": 313}),
        PublicTrain("C", "northbound", {"c": 320, "b": 324}),
    ]
    found = mean_intervals(trains, ("a", "b", "c"), day_periods("c"))
    early = {
        (row.from_station, row.to_station): (row.mean_s, row.trains)
        for row in found
        if row.period == "early"
    }
    assert early == {("a", "b"): (120.0, 1), ("b", "c"): (180.0, 1), ("c", "b"): (240.0, 1)}


def example(peak_s: dict[str, float], error_s: float) -> list[Interval]:
    """Return intervals of legs that end at the stations, each 100 s in quiet hours."""
    periods = {"quiet": 0.0, "peak": 1.0, "06:00": 0.0}
    periods |= dict.fromkeys(("06:30", "07:00", "07:30", "08:00", "08:30", "09:00"), 1.0)
    return [
        Interval("before", station, "southbound", period, 10, 100.0 + share * extra_s, error_s)
        for period, share in periods.items()
        for station, extra_s in peak_s.items()
    ]


def test_the_peak_is_drawn_to_its_mean_as_far_as_it_is_noise() -> None:
    extra_s = {"a": 0.0, "b": 10.0, "c": 20.0}
    sure = [excess.smoothed_s for excess in peak_excesses(example(extra_s, 0.0))]
    # Variance 100, mean square error 25 + 25.
    half = [excess.smoothed_s for excess in peak_excesses(example(extra_s, 5.0))]
    noise = [excess.smoothed_s for excess in peak_excesses(example(extra_s, 20.0))]
    assert sure == pytest.approx([0.0, 10.0, 20.0])
    assert half == pytest.approx([5.0, 10.0, 15.0])
    assert noise == pytest.approx([10.0, 10.0, 10.0])


def test_half_hours_have_their_share_of_the_peak() -> None:
    shares = shares_of_peak(example({"a": 0.0, "b": 10.0, "c": 20.0}, 0.0))
    assert [share.start_min for share in shares] == list(range(360, 570, 30))
    assert [share.smoothed for share in shares] == pytest.approx([0.0] + [1.0] * 6)


def quiet_leg(start: str, end: str, dwell_s: int) -> QuietLeg:
    return QuietLeg(start, end, SOUTHBOUND, 100.0 + dwell_s, 1.0, dwell_s, 80.0, 60, 100.0, 0.0)


def test_booked_dwells_are_the_quiet_one_and_what_the_peak_adds() -> None:
    today = [
        {"station": name, "minimum_dwell_s": "7", "booked_dwell_s": "9", "delay_scale": "1.5"}
        for name in ("before", "a", "b", "c")
    ]
    quiet = [quiet_leg("before", "a", 30), quiet_leg("a", "b", 20), quiet_leg("b", "c", 45)]
    assert list(dwell_rows(example({"a": 0.0, "b": 10.0, "c": 20.0}, 0.0), quiet, today)) == [
        ("before", "", "", "7", "9", "1.5"),
        ("a", "", "", "25", "30", "1.5"),
        ("b", "06:30:00", "09:30:00", "25", "30", "1.5"),
        ("b", "", "", "15", "20", "1.5"),
        ("c", "06:30:00", "09:30:00", "60", "65", "1.5"),
        ("c", "", "", "40", "45", "1.5"),
    ]


def test_the_shipped_dwells_are_booked_by_the_rule(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dwells", str(tmp_path / "dwells.csv")]) == 0
    assert "akabane" in capsys.readouterr().out
    again = (tmp_path / "dwells.csv").read_bytes()
    assert again == (RUSH_HOUR / "dwell_stations.csv").read_bytes()


@pytest.fixture(scope="module")
def legs() -> list[QuietLeg]:
    source = read_source(RUSH_HOUR)
    (train_type,) = source.train_types.values()
    driven = source.line, train_type, source.driving
    return quiet_legs(read_intervals(RUSH_HOUR / "public_intervals.csv"), driven)


def test_the_shipped_driven_speeds_are_those_of_the_quiet_hours(
    legs: list[QuietLeg], tmp_path: Path
) -> None:
    write_speeds(legs, read_source(RUSH_HOUR).line, tmp_path / "speeds.csv")
    write_quiet(legs, tmp_path / "quiet.csv")
    for again, shipped in (("speeds.csv", "driven_speeds.csv"), ("quiet.csv", "quiet_runs.csv")):
        assert (tmp_path / again).read_bytes() == (RUSH_HOUR / shipped).read_bytes()
    assert read_quiet(tmp_path / "quiet.csv") == legs


def test_normal_runs_and_quiet_dwells_are_as_long_as_public_intervals(
    legs: list[QuietLeg],
) -> None:
    south = [leg for leg in legs if leg.direction == SOUTHBOUND]
    assert len(south) == 14
    for leg in south:
        assert leg.run_s + leg.dwell_s == pytest.approx(leg.public_s, abs=3.0)
        assert leg.quickest_s <= leg.run_s
        assert 15 <= leg.dwell_s <= 60


def test_what_was_found_southbound_holds_northbound_in_sum(legs: list[QuietLeg]) -> None:
    north = [leg for leg in legs if leg.direction == NORTHBOUND]
    assert len(north) == 13
    public_s = sum(leg.public_s for leg in north)
    assert sum(leg.run_s + leg.dwell_s for leg in north) == pytest.approx(public_s, rel=0.02)


def test_a_known_proportion_of_runs_is_found_again() -> None:
    line = straight_line({"a": 300.0, "b": 1500.0, "c": 3400.0, "d": 4500.0}, 5000.0)
    train, style = commuter_train(), DrivingStyle("level", driven_speeds=True)
    top_mps = train.maximum_speed_mps
    ends_m = {station.id: station.chainage_m for station in line.stations}
    names = [station.id for station in line.stations]
    intervals = []
    for start, end in pairwise(names):
        quickest_s = driven_s(line, train, style, (ends_m[start], ends_m[end]), top_mps)
        intervals.append(Interval(start, end, SOUTHBOUND, QUIET, 9, 1.2 * quickest_s + 30.0, 1.0))
    for leg in quiet_legs(intervals, (line, train, style)):
        assert leg.dwell_s == 30
        assert leg.run_s == pytest.approx(1.2 * leg.quickest_s, abs=1.5)
