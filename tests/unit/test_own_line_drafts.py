"""Lists of stations, regular timetables, trains of five figures: what a line of one's own is of."""

from itertools import pairwise
from pathlib import Path

import pytest

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.commented import commented
from kankaku.scenarios.drafts.draft import write_files
from kankaku.scenarios.drafts.line_answers import LineAnswers, wish_of
from kankaku.scenarios.drafts.own_line import OwnLine, drafted, own_line
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import train_types_of
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.drafts.station_texts import identifiers, stations_of
from kankaku.scenarios.drafts.stock_library import library_names, library_train
from kankaku.scenarios.drafts.train_figures import EXAMPLE, train_of_figures
from kankaku.scenarios.loading.load import load

SMALL = LineAnswers(stations="Airport 0, Park 1.1, City 2.3, Zoo 4", headway="150")


def line_of(**said: object) -> OwnLine:
    fields = {name: getattr(SMALL, name) for name in SMALL.__slots__}
    return own_line(wish_of(LineAnswers(**{**fields, **said}), "small"))


def refused(**said: object) -> str:
    with pytest.raises(KankakuError) as raised:
        line_of(**said)
    return "\n".join(raised.value.sentences)


def test_stations_come_from_a_text_or_a_table(tmp_path: Path) -> None:
    typed = stations_of("Airport 0, Old Park 1.1km; City 2.3")
    assert not typed.mistakes
    assert [stop.id for stop in typed.stops] == ["airport", "old_park", "city"]
    table = tmp_path / "stations.csv"
    table.write_text("name,km\nAirport,0\nOld Park,1.1\nCity,2.3\n", encoding="utf-8-sig")
    assert stations_of(str(table)) == typed


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ("Airport 0", "1 stations"),
        ("Airport 0, Park x", "'x' is no number"),
        ("Airport 0, Park 1100", "too far"),
        ("Airport 1, Park 0.5", "does not lie beyond 'Airport'"),
        ("Airport 0, airport 2", "two of that name"),
        ("missing.csv", "No such file"),
    ],
)
def test_wrong_stations_are_told(told: str, said: str) -> None:
    read = stations_of(told)
    assert not read.stops
    assert any(said in sentence for sentence in read.mistakes)


def test_all_that_is_wrong_is_told_at_once() -> None:
    told = refused(
        stations="A 0, B z", headway="1e9", dwell="x", train="metr", pattern="A to Q", driving="up"
    )
    for option in ("--stations", "--headway", "--dwell", "'metro'", "--driving"):
        assert option in told


def test_names_in_any_letters_get_identifiers_of_their_own() -> None:
    assert identifiers(["Größe", "大宮", "大宮 2", "up", "9 de Julio"]) == [
        "groe",
        "station",
        "s2",
        "sup",
        "s9_de_julio",
    ]


def test_trains_run_one_headway_apart_in_both_directions() -> None:
    line = line_of()
    for rising in (True, False):
        starts_s = [
            trip.calls[0].departure_s
            for trip in line.booked.trips
            if line.sketch.rises(trip) is rising
        ]
        assert len(starts_s) > 20
        assert {later - sooner for sooner, later in pairwise(sorted(starts_s))} == {150}


def test_stock_turns_back_in_no_less_than_the_least_time() -> None:
    line = line_of(turn_back="140")
    by_id = {trip.id: trip for trip in line.booked.trips}
    linked = [trip for trip in line.booked.trips if trip.next_trip]
    assert linked
    for trip in linked:
        follower = by_id[trip.next_trip]
        assert follower.calls[0].station == trip.calls[-1].station
        assert follower.calls[0].departure_s - trip.calls[-1].arrival_s >= 140
    assert line.booked.sets == len(line.booked.trips) - len(linked)


def test_workings_take_turns_and_keep_the_headway_where_they_meet() -> None:
    line = line_of(pattern="full, Park to City", headway="120")
    at_city_s = sorted(
        call.arrival_s
        for trip in line.booked.trips
        if line.sketch.rises(trip)
        for call in trip.calls
        if call.station == "city"
    )
    gaps_s = {later - sooner for sooner, later in pairwise(at_city_s)}
    assert gaps_s == {120}
    ends = {(trip.calls[0].station, trip.calls[-1].station) for trip in line.booked.trips}
    assert ends == {
        ("airport", "zoo"),
        ("zoo", "airport"),
        ("park", "city"),
        ("city", "park"),
    }


def test_trains_of_a_single_track_meet_at_stations_alone() -> None:
    line = line_of(single_track=True, headway="480")
    taken: dict[frozenset[str], list[tuple[int, int, bool]]] = {}
    for trip in line.booked.trips:
        for call, after in pairwise(trip.calls):
            leg = frozenset((call.station, after.station))
            span = call.departure_s, after.arrival_s, line.sketch.rises(trip)
            taken.setdefault(leg, []).append(span)
    for spans in taken.values():
        for (_, before_s, way), (start_s, _, other) in pairwise(sorted(spans)):
            assert way is other or start_s >= before_s + 60


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"headway": "40"}, "come and go through the points"),
        ({"headway": "90", "terminal_tracks": "2"}, "need 3 tracks at a terminal"),
        ({"headway": "200", "single_track": True}, "too short for a single track"),
        ({"stations": "A 0, B 0.15"}, "150 m apart"),
    ],
)
def test_a_headway_that_cannot_be_is_refused_with_the_least_one(
    said: dict[str, object], why: str
) -> None:
    told = refused(**said)
    assert why in told
    assert "or more" in told


def test_the_least_headway_that_is_told_can_be_had() -> None:
    told = refused(headway="90", terminal_tracks="2")
    least = told.partition("allowed: ")[2].partition(" s")[0]
    assert line_of(headway=least).booked.trips


def test_what_was_not_said_stands_in_the_notes() -> None:
    notes = line_of().sketch.notes
    assert any("150 s" in taken.what for taken in notes.taken)
    assumed = {assumed.what: assumed.value for assumed in notes.assumed}
    assert assumed["least turn-back"] == "120 s"
    assert "metro" in assumed["train"]


def test_a_drafted_line_says_itself_what_may_be_changed(tmp_path: Path) -> None:
    line = line_of()
    plain = drafted(line)
    write_files(plain.files(), tmp_path / "plain")
    write_files(commented(drafted(line), "A train").files(), tmp_path / "told")
    told = (tmp_path / "told" / "scenario.toml").read_text("utf-8")
    assert "# from an arrival to the departure of the same stock" in told
    scenarios = [load(tmp_path / name) for name in ("plain", "told")]
    assert scenarios[0].controllers == scenarios[1].controllers
    assert scenarios[0].train_types == scenarios[1].train_types


@pytest.mark.parametrize("name", library_names())
def test_every_train_of_the_library_can_run_and_says_where_it_is_from(name: str) -> None:
    train = library_train(name)
    sketch = Sketch(name, SourceNotes(""), (), (), {name: train.entry})
    found = train_types_of(sketch)[name]
    assert 10.0 < found.length_m < 900.0
    assert train.source
    assert train.assumed
    # A train that runs in the library runs on a line, too.
    made = drafted(line_of(train=name, stations="A 0, B 3, C 7", headway="600"))
    assert made.rows["services.csv"]


def test_five_figures_make_a_train() -> None:
    read = train_of_figures(EXAMPLE)
    assert read.train is not None
    sketch = Sketch("own", SourceNotes(""), (), (), {"own": read.train.entry})
    found = train_types_of(sketch)["own"]
    pull_mps2 = found.traction.starting_force_n / found.mass_kg / (1 + found.rotating_mass_ratio)
    assert pull_mps2 == pytest.approx(1.0, abs=1e-3)
    assert found.service_brake_mps2 == pytest.approx(1.0, abs=1e-3)
    assert "starting force" in read.train.assumed


@pytest.mark.parametrize("told", ["", "length_m=1", "mass=3", EXAMPLE.replace("120", "nan")])
def test_wrong_figures_are_told(told: str) -> None:
    read = train_of_figures(told)
    assert read.train is None
    assert all("--train-figures" in sentence for sentence in read.mistakes)
