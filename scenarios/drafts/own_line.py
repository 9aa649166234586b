"""A line of one's own: a list of stations, a headway and a train make a whole scenario."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil, sqrt

from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.checks.check_network_timetable import STUCK
from kankaku.scenarios.drafts.completing import UnsoundDraftError, completed
from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.meetings import THROATS
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.regular_times import (
    Regular,
    RegularTrips,
    RunTime,
    Working,
    regular_trips,
)
from kankaku.scenarios.drafts.runs import Runs, train_types_of
from kankaku.scenarios.drafts.single_line_times import least_single_headway, single_trips
from kankaku.scenarios.drafts.sketch import Sketch, Stop
from kankaku.scenarios.drafts.station_sizes import BEYOND_M, PROOF_S, THROW_S
from kankaku.scenarios.drafts.stays import CLEARING_S
from kankaku.scenarios.drafts.stock_library import LibraryTrain

REACTION_S, ROOM_S = 2.0, 6.0
"""Until a brake takes effect; what a terminal has in hand beside. [s]"""
MOST_TERMINAL_TRACKS = 8
MOST_TRIPS = 5000


class OwnLineError(KankakuError):
    """
    A line of one's own that cannot be made.

    Parameters
    ----------
    mistakes
        Everything that is wrong with it, a sentence each.
    """

    verdict = "cannot be made"

    def __init__(self, mistakes: Iterable[str]) -> None:
        self._mistakes = tuple(mistakes)
        super().__init__("\n".join(self._mistakes))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return self._mistakes


@dataclass(frozen=True, slots=True)
class LineWish:
    """What somebody wants of a line of his own."""

    title: str
    stops: tuple[Stop, ...]
    train: LibraryTrain
    headway_s: int = 300
    from_s: int = 25200
    until_s: int = 28800
    workings: tuple[Working, ...] = ()
    """From end to end if empty."""
    turn_back_s: int = 120
    dwell_s: int = 30
    supplement_percent: float = 5.0
    terminal_tracks: int | None = None
    """At most so many tracks at a terminal; as many as the headway needs if None."""
    single_track: bool = False
    left_hand: bool = True
    given: frozenset[str] = frozenset()
    """Names of these that were said, and are not what holds where nothing is said."""


@dataclass(frozen=True, slots=True)
class OwnLine:
    """A drafted line, and what its timetable takes."""

    sketch: Sketch
    booked: RegularTrips
    throat_s: float
    """See :attr:`kankaku.scenarios.drafts.regular_times.Regular.throat_s`."""


def throat_s(train: TrainType) -> float:
    """
    Return how long after a departure at a terminal the next train can arrive there.

    The one that departs clears the points, they are thrown, and the next one brakes into the
    platform, which it could not see free before.

    Parameters
    ----------
    train
        The train.

    Returns
    -------
    float
        At an ordinary throat, with constant acceleration and brake. [s]
    """
    pull_mps2 = train.traction.starting_force_n / train.mass_kg / (1.0 + train.rotating_mass_ratio)
    run_in_m = float(sum(THROATS[0])) + train.length_m
    clears_s = sqrt(2.0 * run_in_m / pull_mps2)
    brake_mps2 = train.service_brake_mps2
    speed_mps = min(train.maximum_speed_mps, sqrt(2.0 * brake_mps2 * run_in_m))
    rolls_s = max(run_in_m - speed_mps**2 / (2.0 * brake_mps2), 0.0) / speed_mps
    return clears_s + THROW_S + PROOF_S + REACTION_S + rolls_s + speed_mps / brake_mps2 + ROOM_S


def own_line(wish: LineWish) -> OwnLine:
    """
    Make stations, trains and a timetable of what somebody wants.

    Parameters
    ----------
    wish
        What is wanted; every figure alone is sensible.

    Returns
    -------
    OwnLine
        Sketch and timetable; what was assumed stands in the notes.

    Raises
    ------
    OwnLineError
        If the headway is too short for terminals or single track, with the least one.
    DraftError
        If the train is none.
    """
    notes = _notes(wish)
    types = {wish.train.name: wish.train.entry}
    sketch = Sketch(wish.title, notes, wish.stops, (), types)
    sketch.single_track, sketch.left_hand = wish.single_track, wish.left_hand
    sketch.minimum_turn_back_s = float(wish.turn_back_s)
    train = train_types_of(sketch)[wish.train.name]
    runs, stations = Runs(sketch), [stop.id for stop in wish.stops]
    asked = Regular(
        wish.headway_s,
        wish.from_s,
        wish.until_s,
        wish.workings or (Working(stations[0], stations[-1]),),
        max(wish.turn_back_s, 2 * wish.dwell_s),
        wish.train.name,
        dict.fromkeys(stations, wish.dwell_s),
        wish.supplement_percent / 100.0,
        throat_s(train),
        wish.terminal_tracks or MOST_TERMINAL_TRACKS,
    )

    def run_s(start: str, end: str) -> float:
        return runs.between_s(start, end, wish.train.name)

    _refuse_near(wish, train)
    _refuse_many(wish)
    _refuse_headway(wish, asked, run_s)
    make = single_trips if wish.single_track else regular_trips
    booked = make(stations, run_s, asked)
    _refuse_tracks(wish, asked, booked)
    sketch.trips = booked.trips
    _note_times(notes, booked)
    return OwnLine(sketch, booked, asked.throat_s)


def _refuse_near(wish: LineWish, train: TrainType) -> None:
    least_km = (train.length_m + 2.0 * BEYOND_M) / 1000.0
    near = [
        f"--stations: {one.name!r} and {other.name!r} lie {1000.0 * away_km:.0f} m apart; allowed: "
        f"{1000.0 * least_km:.0f} m or more with trains of {train.length_m:g} m"
        for one, other in zip(wish.stops, wish.stops[1:], strict=False)
        if (away_km := other.chainage_km - one.chainage_km) < least_km
    ]
    if near:
        raise OwnLineError(near)


def _refuse_many(wish: LineWish) -> None:
    trips = 2 * (wish.until_s - wish.from_s) // wish.headway_s
    if trips > MOST_TRIPS:
        told = f"--headway: {wish.headway_s} s from --from until --until are {trips} trains"
        raise OwnLineError([f"{told}; allowed: {MOST_TRIPS} or fewer"])


def _refuse_headway(wish: LineWish, asked: Regular, run_s: RunTime) -> None:
    if wish.single_track:
        stations = [stop.id for stop in wish.stops]
        least_s, (one, other) = least_single_headway(stations, run_s, asked)
        if wish.headway_s < least_s:
            names = {stop.id: stop.name for stop in wish.stops}
            told = f"--headway: {wish.headway_s} s is too short for a single track"
            why = f"{names[one]!r} to {names[other]!r} and back takes that"
            raise OwnLineError([f"{told}; allowed: {least_s} s or more, since {why}"])
        return
    told = too_short(wish.headway_s, asked, wish.terminal_tracks)
    if told:
        raise OwnLineError([told])


def too_short(headway_s: int, asked: Regular, most_tracks: int | None) -> str:
    """
    Return why terminals do not allow a headway.

    Parameters
    ----------
    headway_s
        The headway. [s]
    asked
        Workings and turn-backs.
    most_tracks
        At a terminal; as many as anybody builds if None.

    Returns
    -------
    str
        A sentence with the least headway; empty if they allow it.
    """
    # Every headway one train comes in through the points and one goes out.
    ends = [end for working in asked.workings for end in working]
    share = len(asked.workings) / max(map(ends.count, ends))
    throat = ceil((asked.throat_s + THROW_S + PROOF_S) / share)
    tracks = most_tracks or MOST_TERMINAL_TRACKS
    occupied_s = asked.turn_back_s + CLEARING_S
    by_tracks = ceil(occupied_s / tracks / share)
    least_s = max(throat, by_tracks)
    if headway_s >= least_s:
        return ""
    needed = ceil(occupied_s / (headway_s * share))
    why = (
        f"trains that come and go through the points of a terminal need {throat} s"
        if throat >= by_tracks
        else f"turn-backs of {asked.turn_back_s} s and {CLEARING_S} s to clear need {needed} "
        f"tracks at a terminal, and there are {tracks}"
    )
    return f"--headway: {headway_s} s is too short; allowed: {least_s} s or more, since {why}"


def _refuse_tracks(wish: LineWish, asked: Regular, booked: RegularTrips) -> None:
    if wish.terminal_tracks is None:
        return
    wrong = []
    for station, turn_s in sorted(booked.turns_s.items()):
        share = sum(station in working for working in asked.workings) / len(asked.workings)
        needed = ceil((turn_s + CLEARING_S) * share / wish.headway_s)
        if needed > wish.terminal_tracks:
            wrong.append(
                f"--terminal-tracks: {wish.terminal_tracks} at {station!r}, where trains of this "
                f"headway turn back in {turn_s} s; allowed: {needed}, or a longer --headway"
            )
    if wrong:
        raise OwnLineError(wrong)


def _notes(wish: LineWish) -> SourceNotes:
    notes = SourceNotes("A line of one's own, made by `kankaku new` of what was asked for.")
    notes.take("stations and chainages", "--stations")
    said: Mapping[str, tuple[str, str, str]] = {
        "headway_s": ("headway", f"{wish.headway_s} s", "--headway"),
        "turn_back_s": ("least turn-back", f"{wish.turn_back_s} s", "--turn-back"),
        "dwell_s": ("booked dwell at every station", f"{wish.dwell_s} s", "--dwell"),
        "supplement_percent": (
            "booked over least run times",
            f"{wish.supplement_percent:g} % more",
            "--supplement",
        ),
    }
    for key, (what, value, option) in said.items():
        if key in wish.given:
            notes.take(f"{what}: {value}", option)
        else:
            notes.assume(what, value, f"{option} was not said")
    train = wish.train
    if "train" in wish.given:
        notes.take(f"train: {train.title}", train.source)
    else:
        notes.assume(
            "train", f"{train.name}: {train.title}", f"--train was not said; {train.source}"
        )
    if wish.turn_back_s < 2 * wish.dwell_s:
        why = "the same stock stops twice there"
        notes.assume("shortest booked turn-back", f"{2 * wish.dwell_s} s", why)
    if train.assumed:
        notes.assume(f"figures of the train {train.name}", train.assumed, "the source has them not")
    notes.miss("limits, gradients and curves", "the line is level and straight")
    notes.miss("dwell delays", "every dwell is as booked until scenario.toml says otherwise")
    return notes


def _note_times(notes: SourceNotes, booked: RegularTrips) -> None:
    turns = ", ".join(f"{name} {turn_s} s" for name, turn_s in sorted(booked.turns_s.items()))
    notes.assume(
        "booked times",
        f"least run times and the supplement, in whole seconds; turn-backs up to {turns or '-'}",
        "chosen so that terminals take the fewest tracks, and the line the fewest trains",
    )
    if booked.stretched_s:
        notes.assume(
            "longer run times of falling trains",
            f"{booked.stretched_s} s on the whole line",
            "so that trains of both directions are not in each other's way",
        )


def drafted(line: OwnLine) -> Draft:
    """
    Lay tracks for a line of one's own, and give it blocks and controllers.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Draft
        All files of a scenario that can be loaded. Blocks are as short as its trains need to find
        room behind each other.

    Raises
    ------
    DraftError
        If stations lie too near to each other for their points.
    OwnLineError
        If trains would wait for each other for ever, whatever the blocks.
    """
    try:
        return completed(line.sketch)
    except UnsoundDraftError as error:
        told = [_crowded(line) if STUCK in told else told for told in error.sentences]
        raise OwnLineError(told) from error


def _crowded(line: OwnLine) -> str:
    return (
        f"--headway: {line.booked.sets} trains find no room behind each other on this line, and "
        "would wait for each other for ever; allowed: a longer headway, shorter turn-backs, or "
        "fewer workings"
    )
