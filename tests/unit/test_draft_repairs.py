"""What drafts do where stations are near, tracks are few, or trains are booked to overtake."""

from itertools import pairwise

import pytest

from kankaku.scenarios.drafts.completing import UnsoundDraftError, completed, mistakes_of
from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.equipment import equip
from kankaku.scenarios.drafts.layout import lay_out
from kankaku.scenarios.drafts.overtaking import LEAST_GAP_S, kept_in_order
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop, TripCall
from kankaku.scenarios.drafts.station_sizes import least_apart_m
from kankaku.scenarios.drafts.stock_library import library_train
from kankaku.scenarios.reading.row_formats import DwellStationRow, NodeRow


def trip(name: str, *calls: tuple[str, int, int], following: str = "") -> DraftTrip:
    """Return a trip of the library's metro."""
    return DraftTrip(name, "metro", tuple(TripCall(*call) for call in calls), following)


def sketch(places_km: dict[str, float], *trips: DraftTrip) -> Sketch:
    """Return a line with these stations and trips."""
    stops = tuple(Stop(name, name.upper(), km) for name, km in places_km.items())
    return Sketch(
        "Line", SourceNotes("Made up."), stops, trips, {"metro": library_train("metro").entry}
    )


LINE = {"a": 0.0, "b": 1.0, "c": 2.0, "d": 3.0}
SLOW = trip("slow", ("a", 0, 30), ("b", 130, 160), ("c", 400, 430), ("d", 530, 560))


def test_who_keeps_the_order_keeps_the_times() -> None:
    later = trip("later", ("a", 200, 230), ("b", 330, 360), ("c", 600, 630), ("d", 730, 760))
    back = trip("back", ("d", 0, 30), ("c", 130, 160), ("b", 260, 290), ("a", 390, 420))
    found = sketch(LINE, SLOW, later, back)
    assert kept_in_order(found) == found.trips
    assert not found.notes.assumed


@pytest.mark.parametrize("mirrored", [False, True])
def test_who_would_overtake_is_behind_from_there_on(*, mirrored: bool) -> None:
    places_km = {"d": 0.0, "c": 1.0, "b": 2.0, "a": 3.0} if mirrored else LINE
    fast = trip("fast", ("a", 60, 90), ("b", 190, 200), ("d", 380, 410))
    found = sketch(places_km, SLOW, fast)
    made = {one.id: one for one in kept_in_order(found)}
    assert made["slow"] == SLOW
    assert made["fast"].calls[:2] == fast.calls[:2]
    # Between b and d it passes c, where the slow one stands until 430.
    assert made["fast"].calls[2].arrival_s >= 530 + LEAST_GAP_S
    assert made["fast"].calls[2].departure_s - made["fast"].calls[2].arrival_s == 30
    assert "fast" in found.notes.assumed[0].what


def test_who_begins_on_the_way_waits_for_who_comes_through() -> None:
    short = trip("short", ("b", 130, 161), ("c", 300, 330))
    made = {one.id: one for one in kept_in_order(sketch(LINE, SLOW, short))}
    calls = made["short"].calls
    assert calls[0].departure_s >= 160 + LEAST_GAP_S
    assert calls[1].arrival_s >= 430 + LEAST_GAP_S


def test_throats_give_way_where_stations_are_near() -> None:
    length_m = float(library_train("metro").entry["length_m"])
    near_km = round(least_apart_m(length_m) / 1000.0 + 0.001, 3)
    places_km = {"a": 0.0, "b": near_km, "c": 2.0}
    trips = (
        trip("one", ("a", 0, 30), ("b", 90, 120), following="two"),
        trip("two", ("b", 120, 300), ("a", 360, 390)),
        trip("far", ("a", 600, 630), ("b", 690, 720), ("c", 900, 930)),
    )
    draft = lay_out(sketch(places_km, *trips))
    equip(draft)
    assert not mistakes_of(draft)
    nodes = [row for row in draft.rows["nodes.csv"] if isinstance(row, NodeRow)]
    assert all(before.fouling_end_km <= after.fouling_start_km for before, after in pairwise(nodes))
    with pytest.raises(DraftError, match="too near"):
        lay_out(sketch({"a": 0.0, "b": near_km - 0.01, "c": 2.0}, *trips))


def test_no_minimum_dwell_is_longer_than_what_is_booked() -> None:
    quick = trip("quick", ("a", 600, 630), ("b", 730, 738), ("c", 900, 930))
    other = trip("other", ("a", 1200, 1230), ("b", 1330, 1375), ("c", 1500, 1530))
    draft = completed(sketch({"a": 0.0, "b": 1.0, "c": 2.0}, quick, other))
    dwells = [row for row in draft.rows["dwell_stations.csv"] if isinstance(row, DwellStationRow)]
    assert {row.station: row.minimum_dwell_s for row in dwells}["b"] == 8.0


def test_a_draft_that_cannot_run_is_refused_as_its_reader_would() -> None:
    steep = sketch(LINE, SLOW)
    weak = {**steep.train_types["metro"], "service_brake_kmhps": 0.1}
    steep.train_types = {"metro": weak}
    with pytest.raises(UnsoundDraftError) as caught:
        completed(steep)
    assert any("service_brake_kmhps" in sentence for sentence in caught.value.sentences)
