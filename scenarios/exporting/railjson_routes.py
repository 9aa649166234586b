"""Routes of an infrastructure in RailJSON: from each detector to the next one, whichever way."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

Json = dict[str, Any]
BEGIN, END = "BEGIN", "END"
UP, DOWN = "START_TO_STOP", "STOP_TO_START"
EndOfTrack = tuple[str, str]
"""Track section and which of its ends."""
GROUPS: Mapping[str, tuple[tuple[str, str, str], ...]] = {
    "link": (("STATIC", "A", "B"),),
    "point_switch": (("A_B1", "A", "B1"), ("A_B2", "A", "B2")),
    "double_slip_switch": tuple((f"A{a}_B{b}", f"A{a}", f"B{b}") for a in (1, 2) for b in (1, 2)),
}
"""Positions of the switch types that are used, each with the ports that it joins."""
APART_M = 0.01
"""Detectors nearer than that are one place. [m]"""


class _Going(NamedTuple):
    """Where a train goes on behind an end of track."""

    end: EndOfTrack
    switch: str
    group: str


def routes_of(told: Json, ways: Mapping[str, frozenset[str]]) -> list[Json]:
    """
    Return all routes.

    Parameters
    ----------
    told
        An infrastructure with track sections, switches, detectors and buffer stops.
    ways
        Directions in which trains run, by track section.

    Returns
    -------
    list[dict[str, Any]]
        From every detector and buffer stop to the next ones that a train can come to.
    """
    found = list(_Routes(told, ways).all())
    seen: Counter[str] = Counter()
    for route in found:
        name = route["id"]
        seen[name] += 1
        if seen[name] > 1:  # another way between the same two places
            route["id"] = f"{name}.{seen[name]}"
    return found


class _Routes:
    """Follows tracks from detector to detector."""

    def __init__(self, told: Json, ways: Mapping[str, frozenset[str]]) -> None:
        self._ways = ways
        self._length_m = {track["id"]: float(track["length"]) for track in told["track_sections"]}
        self._going: dict[EndOfTrack, list[_Going]] = {}
        own = {kind["id"]: _groups(kind) for kind in told["extended_switch_types"]}
        for switch in told["switches"]:
            self._join(switch, {**GROUPS, **own}[switch["switch_type"]])
        self._detectors: dict[str, list[tuple[float, str]]] = {}
        for detector in told["detectors"]:
            placed = float(detector["position"]), detector["id"]
            self._detectors.setdefault(detector["track"], []).append(placed)
        self._buffers = {
            (stop["track"], BEGIN if stop["position"] == 0.0 else END): stop["id"]
            for stop in told["buffer_stops"]
        }

    def _join(self, switch: Json, groups: Sequence[tuple[str, str, str]]) -> None:
        ports = {port: (end["track"], end["endpoint"]) for port, end in switch["ports"].items()}
        for group, one, other in groups:
            for start, goal in ((one, other), (other, one)):
                going = _Going(ports[goal], switch["id"], group)
                self._going.setdefault(ports[start], []).append(going)

    def all(self) -> Iterator[Json]:
        for (track, end), name in self._buffers.items():
            direction = UP if end == BEGIN else DOWN
            if direction in self._ways[track]:
                at_m = 0.0 if end == BEGIN else self._length_m[track]
                yield from self._from(("BufferStop", name), track, at_m, direction)
        for track, placed in self._detectors.items():
            for at_m, name in placed:
                for direction in sorted(self._ways[track]):
                    yield from self._from(("Detector", name), track, at_m, direction)

    def _from(
        self, entry: tuple[str, str], track: str, at_m: float, direction: str
    ) -> Iterator[Json]:
        for leave, positions in self._ends(track, at_m, direction, {}):
            if leave == entry:
                continue
            yield {
                "id": f"route.{entry[1]}->{leave[1]}",
                "entry_point": {"type": entry[0], "id": entry[1]},
                "entry_point_direction": direction,
                "exit_point": {"type": leave[0], "id": leave[1]},
                "release_detectors": [],
                "switches_directions": dict(positions),
            }

    def _ends(
        self, track: str, at_m: float, direction: str, positions: Mapping[str, str]
    ) -> Iterator[tuple[tuple[str, str], Mapping[str, str]]]:
        """Yield where routes end that come along a track, and how switches lie for them."""
        sign = 1.0 if direction == UP else -1.0
        ahead = sorted(
            (sign * (there_m - at_m), name)
            for there_m, name in self._detectors.get(track, ())
            if sign * (there_m - at_m) > APART_M
        )
        if ahead:
            yield ("Detector", ahead[0][1]), positions
            return
        end = track, END if direction == UP else BEGIN
        if end in self._buffers:
            yield ("BufferStop", self._buffers[end]), positions
        for (after, endpoint), switch, group in self._going.get(end, ()):
            onwards = UP if endpoint == BEGIN else DOWN
            if switch in positions or onwards not in self._ways[after]:
                continue
            start_m = 0.0 if endpoint == BEGIN else self._length_m[after]
            yield from self._ends(after, start_m, onwards, {**positions, switch: group})


def _groups(kind: Json) -> tuple[tuple[str, str, str], ...]:
    return tuple(
        (group, way["src"], way["dst"]) for group, ways in kind["groups"].items() for way in ways
    )
