"""What a train meets along its route: a line told by chainage in the coordinate of its trains."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from kankaku.railway.plan.line import Direction, Gradient, Line, SpeedLimit, TrackCurve

Stretch = TypeVar("Stretch", SpeedLimit, Gradient, TrackCurve)


def line_met(line: Line, route: Sequence[str]) -> Line:
    """
    Return a line as the trains of a route meet it.

    Parameters
    ----------
    line
        The line, with limits, gradients, curves and balises by chainage.
    route
        Tracks of the route, in order.

    Returns
    -------
    Line
        The same line with these in the coordinate of the route, those of other tracks left out; a
        chain as it is. Equal where two routes meet the same.
    """
    if not line.network:
        return line
    tracks = [line.track_by_id[track] for track in route]
    falling = tracks[0].direction is Direction.FALLING
    places = {track.place for track in tracks}
    limits = _on(line, line.limits, places, falling=falling)
    driven = _on(line, line.driven_speeds, places, falling=falling)
    curves = _on(line, line.curves, places, falling=falling)
    gradients = _on(line, line.gradients, places, falling=falling)
    if falling:
        gradients = [replace(one, gradient=-one.gradient) for one in gradients]
    balises_m = map(line.mirrored_m, line.balises_m) if falling else line.balises_m
    return replace(
        line,
        limits=tuple(limits),
        driven_speeds=tuple(driven),
        gradients=tuple(gradients),
        curves=tuple(curves),
        balises_m=tuple(sorted(balises_m)),
    )


def lines_met(line: Line, routes: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], Line]:
    """
    Return a line as the trains of each route meet it.

    Parameters
    ----------
    line
        The line.
    routes
        Tracks of every route, in order.

    Returns
    -------
    dict[tuple[str, ...], Line]
        By route; one and the same object where two routes meet the same.
    """
    found: dict[tuple[str, ...], Line] = {}
    known: dict[tuple[object, ...], Line] = {}
    for route in routes:
        if route not in found:
            met = line_met(line, route)
            alike = met.limits, met.driven_speeds, met.gradients, met.curves, met.balises_m
            found[route] = known.setdefault(alike, met)
    return found


def _on(
    line: Line, stretches: Iterable[Stretch], places: set[str], *, falling: bool
) -> list[Stretch]:
    """Return the stretches that hold on some physical tracks, along the way of their trains."""
    found = [one for one in stretches if not one.track or one.track in places]
    if falling:
        found = [
            replace(one, start_m=line.mirrored_m(one.end_m), end_m=line.mirrored_m(one.start_m))
            for one in found
        ]
    return sorted(found, key=lambda one: (one.start_m, one.end_m))
