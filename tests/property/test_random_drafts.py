"""Lines at random, laid out: each becomes a scenario that is read, or is refused with a reason."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import HealthCheck, assume, event, given
from hypothesis import strategies as st

from kankaku.scenarios.drafts.circulation import linked
from kankaku.scenarios.drafts.completing import completed
from kankaku.scenarios.drafts.draft import Draft, DraftError, write_files
from kankaku.scenarios.drafts.layout_notes import CROWDED
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop, TripCall
from kankaku.scenarios.drafts.stock_library import library_train
from kankaku.scenarios.loading.load import load
from tests.examples import examples
from tests.networks import run_network
from tests.property.test_random_networks import assert_nobody_meets

FIRST_S = 25_200
REASONS = ("too near for platforms and points", "would wait for each other for ever")
"""Why a line whose trips are sound may be refused."""
METRO = library_train("metro").entry


@st.composite
def sketches(draw: st.DrawFn) -> Sketch:
    """Draw a line and trips on it that call here and there, and begin and end anywhere."""
    gaps_m = draw(st.lists(st.sampled_from([290, 420, 700, 1100, 2500]), min_size=1, max_size=6))
    chainages_m = [0]
    for gap_m in gaps_m:
        chainages_m.append(chainages_m[-1] + gap_m)
    stops = tuple(Stop(f"s{n}", f"Stop {n}", m / 1000.0) for n, m in enumerate(chainages_m))
    ways = draw(st.sampled_from([(True,), (False,), (True, False), (True, False)]))
    trips = tuple(
        _trip(draw, f"t{number}", chainages_m, rises=draw(st.sampled_from(ways)))
        for number in range(draw(st.integers(1, 20)))
    )
    sketch = Sketch(
        *("Drawn", SourceNotes("drawn at random"), stops, trips, {"metro": METRO}),
        single_track=draw(st.booleans()),
        left_hand=draw(st.booleans()),
    )
    if draw(st.booleans()):
        sketch.trips = linked(trips, 120.0, {trip.id: sketch.rises(trip) for trip in trips})
    return sketch


def _trip(draw: st.DrawFn, name: str, chainages_m: list[int], *, rises: bool) -> DraftTrip:
    last = len(chainages_m) - 1
    ends = draw(st.lists(st.integers(0, last), min_size=2, max_size=2, unique=True))
    whole = draw(st.booleans())
    low, high = (0, last) if whole else (min(ends), max(ends))
    called = [n for n in range(low, high + 1) if n in {low, high} or draw(st.integers(0, 3))]
    time_s = FIRST_S + 30 * draw(st.integers(0, 80))
    calls: list[TripCall] = []
    at = called[0]
    for station in called if rises else called[::-1]:
        if calls:
            slower = draw(st.sampled_from([1.0, 1.2, 2.0]))
            time_s += round(slower * (25 + abs(chainages_m[station] - chainages_m[at]) / 15))
        at = station
        dwell_s = draw(st.sampled_from([0, 20, 30, 30, 45, 240]))
        calls.append(TripCall(f"s{station}", time_s, time_s + dwell_s))
        time_s += dwell_s
    return DraftTrip(name, "metro", tuple(calls))


@given(sketch=sketches())
@examples(150)
def test_line_at_random_can_be_run_or_is_refused_with_a_reason(sketch: Sketch) -> None:
    kind = "single" if sketch.single_track else "double"
    draft, told = _laid_out(sketch)
    event(f"{kind}: {'laid out' if draft else told.partition('allowed')[0][-60:]}")
    assert (draft is None) == any(reason in told for reason in REASONS), told
    if draft is None:
        return
    with TemporaryDirectory() as place:
        write_files(draft.files(), Path(place))
        scenario = load(Path(place))
    assert len(scenario.timetable.services) == len(sketch.trips)


def _laid_out(sketch: Sketch) -> tuple[Draft | None, str]:
    try:
        return completed(sketch), ""
    except DraftError as error:
        return None, str(error)


@given(sketch=sketches(), protection=st.sampled_from(["moving_block", "multi_step_atc", "atd"]))
@examples(40, HealthCheck.filter_too_much)
def test_trains_of_a_line_at_random_arrive_and_meet_nobody(sketch: Sketch, protection: str) -> None:
    sketch.trips = tuple(replace(trip, next_trip="") for trip in sketch.trips[:6])
    sketch.driving = {"step_s": 0.5}
    draft, _ = _laid_out(sketch)
    assume(draft is not None)
    assert draft is not None
    crowded = any(missing.what == CROWDED for missing in draft.notes.missing)
    assume(not crowded or protection == "moving_block")
    with TemporaryDirectory() as place:
        write_files(draft.files(), Path(place))
        scenario = load(Path(place))
    record, engine = run_network(scenario, protection=protection)
    assert [violation.message for violation in record.violations] == []
    assert record.unfinished == ()
    assert_nobody_meets(record, engine)
