"""Ways through an infrastructure in RailJSON: the longest one, or the one that is asked for."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import NamedTuple

from kankaku.railway.errors import suggesting
from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.importing.railjson_network import (
    BEGIN,
    BOTH,
    END,
    START_TO_STOP,
    STOP_TO_START,
    Beside,
    RailjsonTracks,
    Spot,
    Stopping,
    Stretch,
    TrackEnd,
)
from kankaku.scenarios.reading.mistakes import Mistake

MOST_ENDS = 400
"""Ends of track from which the longest way is looked for. [-]"""


class WayPiece(NamedTuple):
    """A track section as a train runs along it."""

    track: str
    forward: bool
    """From its beginning to its end."""


class Laid(NamedTuple):
    """A piece with where it begins along the way."""

    piece: WayPiece
    start_m: float
    length_m: float


@dataclass(frozen=True)
class RailjsonWay:
    """Track sections one after the other."""

    laid: tuple[Laid, ...]

    @property
    def length_m(self) -> float:
        """From end to end. [m]"""
        last = self.laid[-1]
        return last.start_m + last.length_m

    def place_m(self, spot: Spot) -> float | None:
        """Return where a place lies along the way; nothing if it does not."""
        for (track, forward), start_m, length_m in self.laid:
            if track == spot.track:
                return start_m + (spot.position_m if forward else length_m - spot.position_m)
        return None

    def point_m(self, point: Stopping) -> float | None:
        """Return where the way first comes to an operational point; nothing if it does not."""
        found = [at_m for spot in point.spots if (at_m := self.place_m(spot)) is not None]
        return min(found, default=None)

    def stretches(
        self, told: Iterable[Stretch], *, turns: bool = False
    ) -> list[tuple[float, float, float]]:
        """Return start, end [m] and value along the way; a slope turns against the track."""
        by_track: dict[str, list[Stretch]] = {}
        for stretch in told:
            by_track.setdefault(stretch.track, []).append(stretch)
        found = []
        for (track, forward), start_m, length_m in self.laid:
            mine = START_TO_STOP if forward else STOP_TO_START
            for stretch in by_track.get(track, ()):
                if stretch.directions not in {BOTH, mine}:
                    continue
                ends_m = stretch.begin_m, stretch.end_m
                if not forward:
                    ends_m = length_m - stretch.end_m, length_m - stretch.begin_m
                value = -stretch.value if turns and not forward else stretch.value
                found.append((start_m + ends_m[0], start_m + ends_m[1], value))
        return sorted(found)

    def beside_m(self, told: Iterable[Beside]) -> list[float]:
        """Return where things stand that trains of the way heed. [m]"""
        forward_of = {laid.piece.track: laid.piece.forward for laid in self.laid}
        found = set()
        for spot, direction in told:
            if spot.track in forward_of:
                mine = START_TO_STOP if forward_of[spot.track] else STOP_TO_START
                at_m = self.place_m(spot)
                if direction in {BOTH, mine} and at_m is not None:
                    found.add(round(at_m, 3))
        return sorted(found)


def longest_way(tracks: RailjsonTracks, file: str) -> RailjsonWay:
    """
    Return the longest of the shortest ways from an end of track to another.

    Parameters
    ----------
    tracks
        The infrastructure.
    file
        Its name.

    Returns
    -------
    RailjsonWay
        Of ways of one length the one with most operational points, then most signals. A ring is
        cut before its first track section.

    Raises
    ------
    SourceError
        If there is no track, or there are too many ends to try.
    """
    starts = [
        WayPiece(track, forward=endpoint == BEGIN)
        for track in tracks.lengths_m
        for endpoint in (BEGIN, END)
        if TrackEnd(track, endpoint) not in tracks.joined
    ]
    if len(starts) > MOST_ENDS:
        problem, allowed = f"{len(starts)} ends of track", "a route of operational points or tracks"
        raise SourceError((str(Mistake(file, "", problem, allowed)),))
    starts = starts or [WayPiece(track, forward=True) for track in [*tracks.lengths_m][:1]]
    if not starts:
        raise SourceError((str(Mistake(file, "track_sections", "is empty", "one or more")),))
    best: list[tuple[tuple[float, int, int], RailjsonWay]] = []
    for start in starts:
        came = _from(tracks, [(start, 0)], ())
        far = max(came, key=lambda state: round(came[state][0], 3))
        # Several ends may lie equally far.
        ends = [s for s in came if round(came[s][0], 3) == round(came[far][0], 3)]
        for end in ends:
            way = _laid(tracks, came, end)
            worth = (
                round(way.length_m, 3),
                sum(way.point_m(point) is not None for point in tracks.points),
                len(way.beside_m(tracks.signals)),
            )
            if not best or worth > best[0][0]:
                best = [(worth, way)]
    return best[0][1]


def asked_way(tracks: RailjsonTracks, names: Sequence[str], file: str) -> RailjsonWay:
    """
    Return the shortest way past places in the order of a route.

    Parameters
    ----------
    tracks
        The infrastructure.
    names
        Operational points, by what they are called, or track sections.
    file
        Name of the source.

    Returns
    -------
    RailjsonWay
        All of the track sections on which it begins and ends belong to it.

    Raises
    ------
    SourceError
        If a name is unknown, or there is no such way.
    """
    places, mistakes = [], []
    known = [*(point.name for point in tracks.points), *tracks.lengths_m]
    for name in names:
        spots = [spot for point in tracks.points if name in point.codes for spot in point.spots]
        if name in tracks.lengths_m:
            spots.append(Spot(name, tracks.lengths_m[name] / 2.0))
        if not spots:
            told = ", ".join(known[:12]) + (" and more" if len(known) > 12 else "")
            allowed = suggesting(name, known, told)
            mistakes.append(str(Mistake(file, "--route", f"unknown place {name!r}", allowed)))
        places.append({spot.track: spot.position_m for spot in spots})
    if mistakes:
        raise SourceError(tuple(mistakes))
    starts = [
        (piece, _passed(tracks, piece, 0, places))
        for track in places[0]
        for piece in (WayPiece(track, forward=True), WayPiece(track, forward=False))
    ]
    came = _from(tracks, starts, places)
    ends = [state for state in came if state[1] == len(places)]
    if not ends:
        problem = f"no way from {names[0]!r} past {', '.join(map(repr, names[1:]))}"
        allowed = "places that trains can run past in this order without turning back"
        raise SourceError((str(Mistake(file, "--route", problem, allowed)),))
    return _laid(tracks, came, min(ends, key=lambda state: came[state][0]))


State = tuple[WayPiece, int]
"""A piece, and how many of the places that are asked for lie behind its end."""


def _passed(
    tracks: RailjsonTracks, piece: WayPiece, count: int, places: Sequence[Mapping[str, float]]
) -> int:
    """Return how many places are passed when a train has run along a piece."""
    along_m = -1.0
    while count < len(places) and piece.track in places[count]:
        position_m = places[count][piece.track]
        here_m = position_m if piece.forward else tracks.lengths_m[piece.track] - position_m
        if here_m < along_m:
            break
        along_m, count = here_m, count + 1
    return count


def _from(
    tracks: RailjsonTracks, starts: Iterable[State], places: Sequence[Mapping[str, float]]
) -> dict[State, tuple[float, State | None]]:
    """Return how far the end of each reachable state lies [m], and from where it is reached."""
    came: dict[State, tuple[float, State | None]] = {}
    queue: list[tuple[float, int, State, State | None]] = []
    for start in starts:
        heappush(queue, (tracks.lengths_m[start[0].track], len(queue), start, None))
    turn = len(queue)
    while queue:
        far_m, _, state, before = heappop(queue)
        if state in came:
            continue
        came[state] = far_m, before
        piece, count = state
        leaving = TrackEnd(piece.track, END if piece.forward else BEGIN)
        for track, endpoint in tracks.joined.get(leaving, ()):
            after = WayPiece(track, forward=endpoint == BEGIN)
            follower = after, _passed(tracks, after, count, places)
            if follower not in came:
                turn += 1
                heappush(queue, (far_m + tracks.lengths_m[track], turn, follower, state))
    return came


def _laid(
    tracks: RailjsonTracks, came: Mapping[State, tuple[float, State | None]], end: State
) -> RailjsonWay:
    pieces = []
    state: State | None = end
    while state is not None:
        pieces.append(state[0])
        state = came[state][1]
    laid, start_m = [], 0.0
    for piece in reversed(pieces):
        length_m = tracks.lengths_m[piece.track]
        laid.append(Laid(piece, start_m, length_m))
        start_m += length_m
    return RailjsonWay(tuple(laid))
