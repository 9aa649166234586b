"""The order of stations and of trains along a line, against what trying everything finds."""

from dataclasses import replace
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from kankaku.scenarios.drafts.circulation import linked
from kankaku.scenarios.drafts.completing import completed, mistakes_of
from kankaku.scenarios.drafts.overtaking import kept_in_order
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop, TripCall
from kankaku.scenarios.drafts.stock_library import library_train
from kankaku.scenarios.importing.gtfs_order import along, line_order, without_returns
from kankaku.scenarios.importing.gtfs_tables import FeedCall
from kankaku.scenarios.importing.gtfs_trips import DayTrip
from tests.examples import examples

LINE = "abcdefgh"
ways = st.lists(st.sampled_from(LINE), min_size=2, max_size=10)


def parts(way: list[str]) -> list[tuple[str, ...]]:
    """Return all contiguous parts of a way."""
    count = len(way)
    return [tuple(way[a:b]) for a in range(count) for b in range(a + 1, count + 1)]


def day_trip(name: str, way: list[str], direction: int = 0) -> DayTrip:
    """Return a train that calls somewhere every minute."""
    calls = (
        FeedCall(stop, number, 60 * number, 60 * number, None, number)
        for number, stop in enumerate(way, 1)
    )
    return DayTrip(name, name, direction, "", "", tuple(calls))


@given(ways)
@examples(500)
def test_the_longest_way_without_returns(way: list[str]) -> None:
    longest = max((part for part in parts(way) if len({*part}) == len(part)), key=len)
    assert without_returns(way) == longest


@given(ways, st.sets(st.sampled_from(LINE), max_size=2))
@examples(500)
def test_trains_run_along_the_longest_part_in_one_direction(way: list[str], off: set[str]) -> None:
    line = [stop for stop in LINE if stop not in off]
    at = {stop: number for number, stop in enumerate(line)}
    good = [0]
    for part in parts(way):
        places = [at.get(stop, -1) for stop in part]
        if min(places) >= 0 and places in (sorted({*places}), sorted({*places}, reverse=True)):
            good.append(len(part))
    notes = SourceNotes("")
    kept = along([day_trip("x", way)], {stop: stop for stop in LINE}, line, notes)
    assert (len(kept[0].calls) if kept else 0) == (max(good) if max(good) > 1 else 0)
    if kept:
        places = [at[call.stop] for call in kept[0].calls]
        assert places in (sorted({*places}), sorted({*places}, reverse=True))
    whole = bool(kept) and len(kept[0].calls) == len(way)
    assert bool(notes.missing) is not whole


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), min_size=1, max_size=8))
@examples(500)
def test_pieces_of_one_line_make_that_line(ends: list[tuple[int, int]]) -> None:
    trips = []
    for number, (one, other) in enumerate(ends):
        low, high = min(one, other), max(one, other) + 1
        way = [*LINE[low : high + 1]]
        if len(way) > 1:
            trips.append(
                day_trip(str(number), way if one <= other else way[::-1], int(one > other))
            )
    if not trips:
        return
    order = "".join(line_order(trips, {stop: stop for stop in LINE}))
    assert order in LINE or order[::-1] in LINE
    for trip in trips:
        piece = "".join(call.stop for call in trip.calls)
        # A piece that does not touch the others at all is another line.
        if {*piece} & {*order}:
            assert piece in order or piece[::-1] in order


@st.composite
def timetables(draw: st.DrawFn) -> Sketch:
    """Return trains that run, skip and overtake as they like."""
    stops = tuple(Stop(name, name, float(number)) for number, name in enumerate(LINE[:5]))
    trips = []
    for number in range(draw(st.integers(2, 6))):
        places = sorted(draw(st.sets(st.integers(0, 4), min_size=2)))
        if draw(st.booleans()):
            places.reverse()
        at_s, calls = draw(st.integers(0, 600)), []
        for place in places:
            dwell_s = draw(st.integers(15, 90))
            calls.append(TripCall(LINE[place], at_s, at_s + dwell_s))
            at_s += dwell_s + draw(st.integers(30, 400))
        trips.append(DraftTrip(f"t{number}", "metro", tuple(calls)))
    types = {"metro": library_train("metro").entry}
    return Sketch("Line", SourceNotes(""), stops, tuple(trips), types)


@given(timetables())
@examples(500)
def test_nobody_overtakes_any_more(sketch: Sketch) -> None:
    made = kept_in_order(sketch)
    at_km = sketch.at_km
    for before, after in zip(sketch.trips, made, strict=True):
        assert before.id == after.id
        shifts_s = [
            b.arrival_s - a.arrival_s for a, b in zip(before.calls, after.calls, strict=True)
        ]
        assert shifts_s == sorted(shifts_s)
        assert shifts_s[0] >= 0
        for a, b in zip(before.calls, after.calls, strict=True):
            assert b.departure_s - b.arrival_s == a.departure_s - a.arrival_s
    for one in made:
        for other in made:
            if one is other or sketch.rises(one) is not sketch.rises(other):
                continue
            common = [(a, b) for a in one.calls for b in other.calls if a.station == b.station]
            common.sort(key=lambda pair: at_km[pair[0].station], reverse=not sketch.rises(one))
            first = [a.departure_s < b.departure_s for a, b in common]
            # Where one of them ends the other may stand until later.
            goes_on = [a is not one.calls[-1] and b is not other.calls[-1] for a, b in common]
            together = [sign for sign, both in zip(first, goes_on, strict=True) if both]
            assert len({*together}) < 2
    assert all(b.arrival_s > a.departure_s for trip in made for a, b in pairwise(trip.calls))


@given(timetables())
@examples(100)
def test_any_timetable_without_overtaking_becomes_a_scenario(sketch: Sketch) -> None:
    trips = linked(
        kept_in_order(sketch), 120.0, {one.id: sketch.rises(one) for one in sketch.trips}
    )
    draft = completed(replace(sketch, trips=trips))
    assert not mistakes_of(draft)
    assert len(draft.rows["services.csv"]) == len(trips)
