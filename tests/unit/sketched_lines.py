"""Small lines for tests of drafts."""

from collections.abc import Sequence

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop, TripCall

UNIT_TRAIN = {
    "length_m": 100.0,
    "mass_t": 200.0,
    "rotating_mass_percent": 8.0,
    "maximum_speed_kmh": 72.0,
    "service_brake_kmhps": 3.6,
    # 216 kN move 216 t, rotating masses included: 1 m/s2 at any speed.
    "traction": {"starting_force_kn": 216.0, "power_kw": 10000.0},
    "resistance": {"a_n": 0.0},
}
START_S = 25_200


def trip(name: str, start_s: int, calls: Sequence[tuple[str, int]], dwell_s: int = 30) -> DraftTrip:
    """Return a trip by stations and run times; it departs ``start_s`` after seven o'clock."""
    time_s, made = START_S + start_s, []
    for number, (station, run_s) in enumerate(calls):
        arrival_s = time_s + run_s - (0 if number else dwell_s)
        time_s = arrival_s + dwell_s
        made.append(TripCall(station, arrival_s, time_s))
    return DraftTrip(name, "unit", tuple(made))


def there(name: str, start_s: int, run_s: int = 100, stations: str = "abcd") -> DraftTrip:
    """Return a trip that calls at stations of one letter, in their order."""
    return trip(name, start_s, [(one, run_s if at else 0) for at, one in enumerate(stations)])


def line(
    trips: Sequence[DraftTrip],
    *,
    km: Sequence[float] = (0.0, 1.5, 3.0, 4.5),
    single_track: bool = False,
    left_hand: bool = True,
) -> Sketch:
    """Return a line of stations of one letter each."""
    stops = tuple(Stop(chr(97 + at), f"Stop {at}", place) for at, place in enumerate(km))
    return Sketch(
        *("A line", SourceNotes("invented"), stops, tuple(trips), {"unit": UNIT_TRAIN}),
        single_track=single_track,
        left_hand=left_hand,
    )
