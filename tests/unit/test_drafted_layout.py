"""Tracks for a sketch: no more than its trains need, and trains that wait where they have to."""

from dataclasses import replace

import pytest

from kankaku.scenarios.drafts.circulation import joined
from kankaku.scenarios.drafts.completing import UnsoundDraftError, completed
from kankaku.scenarios.drafts.draft import Draft, DraftError
from kankaku.scenarios.drafts.equipment import even_blocks, speed_codes_kmh
from kankaku.scenarios.drafts.layout import lay_out
from kankaku.scenarios.drafts.meetings import Room, loops_of, meetings_of
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.single_line import CLEARED_S, later_than, without_clashes
from kankaku.scenarios.drafts.sketch import Sketch, Stop
from kankaku.scenarios.drafts.stays import dwell_at
from kankaku.scenarios.drafts.whole_minutes import MinuteCall, MinuteTrip, in_seconds
from kankaku.scenarios.reading.row_formats import CallRow, LinkRow, NodeRow
from tests.unit.sketched_lines import line, there

ROOM = Room(0.055, 0.225)


def tracks(draft: Draft) -> dict[str, str]:
    return {row.id: row.direction for row in draft.rows["tracks.csv"] if isinstance(row, LinkRow)}


def tracks_of(draft: Draft, station: str) -> dict[str, str]:
    found = [row for row in draft.rows["calls.csv"] if isinstance(row, CallRow)]
    return {row.train: row.track for row in found if row.station == station}


def test_double_line_has_a_track_for_each_direction_and_what_ends_need() -> None:
    draft = lay_out(line([there("1", 0), there("2", 0, stations="dcba")]))
    assert tracks(draft) == {
        "a-1": "both",
        "a-d-up": "rising",
        "a-d-down": "falling",
        "d-1": "both",
    }


def test_trains_that_stand_at_an_end_at_a_time_have_tracks_of_their_own() -> None:
    draft = lay_out(line([there("1", 0), there("3", 60)]))
    assert len(set(tracks_of(draft, "a").values())) == 2
    # Apart by more than the clearing and the way through the points they need one.
    draft = lay_out(line([there("1", 0), there("3", 400)]))
    assert set(tracks_of(draft, "a").values()) == {"a-1"}


def test_stock_that_turns_back_stays_on_its_track() -> None:
    up, down = joined([replace(there("1", 0), next_trip="2"), there("2", 600, stations="dcba")])
    draft = lay_out(line([up, down]))
    assert tracks_of(draft, "d") == {"1": "d-1", "2": "d-1"}


def test_train_that_begins_on_the_way_stands_beside_those_that_pass() -> None:
    draft = lay_out(line([there("1", 0), there("3", 40, stations="bcd")]))
    assert tracks_of(draft, "b") == {"1": "b-up", "3": "b-1"}
    assert {"b-up", "b-down", "b-1"} <= set(tracks(draft))


def test_line_of_one_direction_has_no_track_for_the_other() -> None:
    assert "falling" not in tracks(lay_out(line([there("1", 0)]))).values()


def test_trains_keep_to_the_right_where_asked() -> None:
    draft = lay_out(line([there("1", 0), there("2", 0, stations="dcba")], left_hand=False))
    across = {row.id: row.across for row in draft.rows["tracks.csv"] if isinstance(row, LinkRow)}
    assert across["a-d-up"] > across["a-d-down"]


def test_stations_too_near_for_points_are_refused_with_what_they_need() -> None:
    with pytest.raises(DraftError, match="lie 150 m apart, too near for platforms and points"):
        lay_out(line([there("1", 0)], km=(0.0, 0.15, 1.0, 2.0)))


def test_points_come_nearer_where_stations_do() -> None:
    draft = lay_out(line([there("1", 0)], km=(0.0, 0.27, 1.5, 3.0)))
    told = {row.what: row.value for row in draft.notes.assumed}
    assert told["points"].startswith("70 m")


@pytest.mark.parametrize(
    ("sketch", "told"),
    [
        (line([]), "no trip is left"),
        (line([there("1", 0, stations="abz")]), "unknown station 'z'"),
        (line([there("1", 0, stations="aba")]), "does not run along the line"),
        (line([there("1", 0, stations="a")]), "does not run along the line"),
        (line([there("1", 0, run_s=-40)]), "is somewhere earlier than it was before"),
        (line([replace(there("1", 0), train_type="x")]), "unknown train type 'x'"),
        (line([replace(there("1", 0), next_trip="9")]), "its stock cannot go on as '9'"),
        (line([there("1", 0)], km=(0.0, 2.0, 1.0, 3.0)), "does not lie after 'b'"),
    ],
)
def test_what_cannot_be_laid_out_is_refused(sketch: Sketch, told: str) -> None:
    with pytest.raises(DraftError) as refusal:
        lay_out(sketch)
    assert told in str(refusal.value)


def test_what_the_reader_refuses_is_not_handed_on() -> None:
    sketch = line([there("1", 0)])
    sketch.stops = (*sketch.stops[:3], Stop("d", "\u202eturned", 4.5))
    with pytest.raises(UnsoundDraftError, match=r"stations\.csv"):
        completed(sketch)


def test_least_dwell_is_never_more_than_what_is_booked() -> None:
    short = replace(there("3", 900), calls=there("3", 900, stations="abcd").calls)
    short = replace(
        short, calls=(short.calls[0], short.calls[1]._replace(departure_s=short.calls[1].arrival_s))
    )
    trips = (there("1", 0), there("2", 400), short)
    assert dwell_at(trips, "c") == (20, 30)
    assert dwell_at(trips, "b") == (0, 30)


def test_trains_meet_where_their_ways_cross() -> None:
    # Departures 07:00:00 at a and at d: both are at 2.25 km after half of the way.
    (met,) = meetings_of(line([there("1", 0), there("2", 0, stations="dcba")]))
    assert met.km == pytest.approx(2.25)
    assert (met.before, met.at_station) == (1, False)
    # Either could wait where it calls before: the other one comes 100 s later.
    assert met.waits_s == pytest.approx((100.0, 100.0))
    late = there("2", -130, stations="dcba")
    (met,) = meetings_of(line([there("1", 0), late]))
    assert met.km == pytest.approx(1.5)
    assert (met.before, met.at_station) == (1, True)


def test_trains_of_one_direction_and_of_other_times_do_not_meet() -> None:
    assert meetings_of(line([there("1", 0), there("3", 60)])) == []
    assert meetings_of(line([there("1", 0), there("2", 2000, stations="dcba")])) == []


def test_loop_lies_at_the_station_where_trains_are_booked_to_meet() -> None:
    sketch = line([there("1", 0), there("2", -130, stations="dcba")], single_track=True)
    draft = lay_out(sketch)
    assert tracks(draft) == {
        "a-1": "both",
        "a-b": "both",
        "b-up": "rising",
        "b-down": "falling",
        "b-d": "both",
        "d-1": "both",
    }
    assert later_than(sketch, sketch) == {}


def test_loop_lies_between_stations_where_waiting_would_be_long() -> None:
    sketch = line([there("1", 0), there("2", 0, stations="dcba")], single_track=True)
    found = loops_of(sketch, {"a", "d"}, ROOM)
    assert found.stations == {"a", "d"}
    assert found.sidings["loop-2"].km == pytest.approx(2.25)
    assert set(found.sidings["loop-2"].trips) == {"1", "2"}
    draft = lay_out(sketch)
    assert tracks_of(draft, "loop-2") == {"1": "loop-2-up", "2": "loop-2-down"}


def test_loop_lies_at_the_station_where_less_waiting_is_needed() -> None:
    # The falling train comes to b 10 s before the rising one departs.
    sketch = line([there("1", 0), there("2", -110, stations="dcba")], single_track=True)
    assert loops_of(sketch, {"a", "d"}, ROOM).stations == {"a", "b", "d"}


def test_train_waits_until_the_other_one_has_come_and_that_is_told() -> None:
    sketch = line([there("1", 0), there("2", -110, stations="dcba")], single_track=True)
    planned = without_clashes(sketch, ["a", "b", "d"])
    one, other = planned.trips
    assert one.calls[1].departure_s == other.calls[2].arrival_s + CLEARED_S
    assert one.calls[2].arrival_s - one.calls[1].departure_s == 100
    assert other.calls == sketch.trips[1].calls
    # Booked to depart at 130 s; the other one comes at 120 s.
    assert later_than(sketch, planned) == {"1": CLEARED_S - 10}
    draft = lay_out(sketch)
    told = {row.what: row.value for row in draft.notes.assumed}
    assert told["times of trains that meet"] == (
        "1 of 2 trains run later than the source says, up to 20 s (1)"
    )


def test_wait_is_caught_up_where_stops_are_longer_than_needed() -> None:
    late = there("1", 0)
    calls = list(late.calls)
    calls[2] = calls[2]._replace(departure_s=calls[2].departure_s + 200)
    calls[3] = calls[3]._replace(
        arrival_s=calls[3].arrival_s + 200, departure_s=calls[3].departure_s + 200
    )
    waiting = replace(late, calls=tuple(calls))
    sketch = line([waiting, there("2", -110, stations="dcba")], single_track=True)
    planned = without_clashes(sketch, ["a", "b", "d"]).trips[0]
    assert planned.calls[2].departure_s == waiting.calls[2].departure_s
    assert planned.calls[3] == waiting.calls[3]


def test_stock_that_comes_late_departs_late() -> None:
    up, down = joined([replace(there("1", 0), next_trip="2"), there("2", 480, stations="dcba")])
    other = there("4", -110, stations="dcba")
    planned = without_clashes(line([up, down, other], single_track=True), ["a", "b", "d"])
    first, second, _ = planned.trips
    assert second.calls[0].arrival_s == first.calls[-1].departure_s
    assert second.calls[0].departure_s >= first.calls[-1].arrival_s + 120


def test_blocks_end_before_points() -> None:
    nodes = [
        NodeRow(0, "n", 0.0, "buffer", 0.0, 0.0),
        NodeRow(0, "m", 1.0, "points", 0.94, 1.06, 5.0, 1.5),
    ]
    edges = [
        (row.start_km, row.end_km)
        for row in even_blocks(nodes, [LinkRow(0, "t", "n", "m", "both", 1.0)])
    ]
    assert edges == [(0.0, 0.235), (0.235, 0.47), (0.47, 0.705), (0.705, 0.94), (0.94, 1.0)]


def test_codes_fall_from_the_fastest_speed() -> None:
    assert speed_codes_kmh(78.0) == [80, 65, 50, 35, 20, 0]


def minutes(
    name: str, calls: str, *times: tuple[int | None, int | None], rises: bool = True
) -> MinuteTrip:
    booked = tuple(MinuteCall(one, *ends) for one, ends in zip(calls, times, strict=True))
    return MinuteTrip(name, "unit", booked, rises)


def test_seconds_stay_within_their_minutes_and_leave_time_to_run() -> None:
    trips = [
        minutes(str(at), "abcd", (None, m), (None, m + 2), (m + 4, m + 4), (m + 6, None))
        for at, m in enumerate(range(420, 480, 10))
    ]
    runs = Runs(line([]))
    timed = in_seconds(trips, runs, single_track=False)
    assert timed.hurried == ()
    for asked, found in zip(trips, timed.trips, strict=True):
        for call, booked in zip(asked.calls, found.calls, strict=True):
            if call.departure_min is not None:
                assert booked.departure_s // 60 == call.departure_min
            if call.arrival_min is not None:
                assert booked.arrival_s // 60 == call.arrival_min
            assert booked.departure_s - booked.arrival_s >= 15
        # 95 s and 3 per cent.
        assert found.calls[1].arrival_s - found.calls[0].departure_s >= 98


def test_minutes_that_are_too_few_for_the_train_are_told() -> None:
    hurried = minutes("1", "ab", (None, 420), (420, None))
    timed = in_seconds([hurried], Runs(line([])), single_track=False)
    assert timed.hurried == ("a to b",)
    assert timed.trips[0].calls[1].arrival_s // 60 == 420


def test_train_that_calls_too_often_within_a_minute_is_refused() -> None:
    calls = ((None, 420), (None, 420), (None, 420), (None, 420))
    with pytest.raises(DraftError, match="no times obey the minutes"):
        in_seconds([minutes("1", "abcd", *calls)], Runs(line([])), single_track=False)


def test_trains_that_meet_at_a_station_depart_after_the_other_one_has_come() -> None:
    up = minutes("1", "abc", (None, 420), (422, 423), (426, None))
    down = minutes("2", "cba", (None, 419), (422, 423), (426, None), rises=False)
    one, other = in_seconds([up, down], Runs(line([])), single_track=True).trips
    assert one.calls[1].departure_s >= other.calls[1].arrival_s + 30
    assert other.calls[1].departure_s >= one.calls[1].arrival_s + 30
