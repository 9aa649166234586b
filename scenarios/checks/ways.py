"""The ways of trains over the tracks of a line, as the files tell them."""

from collections.abc import Mapping, Sequence

from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.row_formats import CallRow


def route_of(line: LineTables, calls: Sequence[CallRow]) -> list[tuple[int, int]]:
    """
    Return the way of a train.

    Parameters
    ----------
    line
        The files of the line.
    calls
        Calls of the train, in order.

    Returns
    -------
    list[tuple[int, int]]
        Section and place of the track within it, from the first call to the end of the
        line, or to the last call where :func:`ends_on_the_way`. Where the train does not call it
        takes the first track behind points, and else the track that goes on. Empty as long as
        a track of the calls is unknown.
    """
    way = _whole_way(line, calls)
    if not ends_on_the_way(line, calls):
        return way
    end = _place_of(line)[calls[-1].track][0]
    # Calls out of order are told elsewhere.
    return [place for place in way if place[0] <= end] or way


def _place_of(line: LineTables) -> dict[str, tuple[int, int]]:
    return {
        track.id: (number, index)
        for number, tracks in enumerate(line.sections)
        for index, track in enumerate(tracks)
    }


def _whole_way(line: LineTables, calls: Sequence[CallRow]) -> list[tuple[int, int]]:
    sections, place = line.sections, _place_of(line)
    if not calls or any(call.track not in place for call in calls):
        return []
    called: Mapping[int, int] = dict(place[call.track] for call in calls)
    points = {round(row.position_km, 6) for row in line.turnouts}
    first, index = place[calls[0].track]
    way = [(first, index)]
    for number in range(first + 1, len(sections)):
        tracks = sections[number]
        parts = round(tracks[0].start_km, 6) in points or index >= len(tracks)
        index = called.get(number, 0 if parts else index)
        way.append((number, index))
    return way


def ends_on_the_way(line: LineTables, calls: Sequence[CallRow]) -> bool:
    """
    Return whether a train ends before a platform of its own way.

    It is taken off the line there, to a siding that is not modelled; other trains run out.

    Parameters
    ----------
    line
        The files of the line.
    calls
        Calls of the train, in order.

    Returns
    -------
    bool
        Whether it does.
    """
    way = _whole_way(line, calls)
    last = line.platform_at.get((calls[-1].station, calls[-1].track)) if calls else None
    if last is None:
        return False
    tracks = {line.sections[number][index].id for number, index in way}
    return any(row.track in tracks and row.stop_km > last.stop_km for row in line.platforms)
