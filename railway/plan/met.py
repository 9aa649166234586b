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
    places = {track.place for track in tracks}
    met = replace(
        line,
        limits=_on(line.limits, places),
        driven_speeds=_on(line.driven_speeds, places),
        gradients=_on(line.gradients, places),
        curves=_on(line.curves, places),
        balises_m=tuple(sorted(line.balises_m)),
    )
    return mirrored(met) if tracks[0].direction is Direction.FALLING else met


def mirrored(line: Line) -> Line:
    """
    Return a line as trains of the other running direction meet it.

    Parameters
    ----------
    line
        The line, with limits, gradients, curves and balises by chainage.

    Returns
    -------
    Line
        The same line with these in the coordinate of falling trains.
    """
    gradients = [replace(one, gradient=-one.gradient) for one in line.gradients]
    return replace(
        line,
        limits=_mirrored(line, line.limits),
        driven_speeds=_mirrored(line, line.driven_speeds),
        gradients=_mirrored(line, gradients),
        curves=_mirrored(line, line.curves),
        balises_m=tuple(sorted(map(line.mirrored_m, line.balises_m))),
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


def _on(stretches: Iterable[Stretch], places: set[str]) -> tuple[Stretch, ...]:
    """Return the stretches that hold on some physical tracks."""
    return _in_order(one for one in stretches if not one.track or one.track in places)


def _mirrored(line: Line, stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    return _in_order(
        replace(one, start_m=line.mirrored_m(one.end_m), end_m=line.mirrored_m(one.start_m))
        for one in stretches
    )


def _in_order(stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    return tuple(sorted(stretches, key=lambda one: (one.start_m, one.end_m)))
