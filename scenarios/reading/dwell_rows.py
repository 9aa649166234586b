"""The dwell times of stations by train type and time of day: which row holds for a call."""

from collections.abc import Iterable
from math import inf

from kankaku.scenarios.reading.row_formats import DwellStationRow
from kankaku.scenarios.reading.units import whole_seconds


def period_s(row: DwellStationRow) -> tuple[float, float]:
    """
    Return when a row holds.

    Parameters
    ----------
    row
        A row of ``dwell_stations.csv``.

    Returns
    -------
    tuple[float, float]
        From this time of day, until before that one; infinite where the row names none. [s]
    """
    from_s = whole_seconds(row.from_time) if row.from_time else -inf
    until_s = whole_seconds(row.until_time) if row.until_time else inf
    return from_s, until_s


class DwellRows:
    """
    The rows of ``dwell_stations.csv``, asked by call.

    A row that names the train's type goes before one that names none, then one with times of day
    before one without.

    Parameters
    ----------
    rows
        All rows.
    """

    def __init__(self, rows: Iterable[DwellStationRow]) -> None:
        self._of_station: dict[str, list[tuple[str, float, float, DwellStationRow]]] = {}
        for row in sorted(rows, key=lambda row: (not row.train_type, period_s(row) == (-inf, inf))):
            entry = (row.train_type, *period_s(row), row)
            self._of_station.setdefault(row.station, []).append(entry)

    def __contains__(self, station: object) -> bool:
        return station in self._of_station

    def find(self, station: str, train_type: str, departure_s: float) -> DwellStationRow | None:
        """
        Return the row that holds for a call.

        Parameters
        ----------
        station
            Where the train calls.
        train_type
            Its type.
        departure_s
            Its booked departure, of which the whole minute counts. [s]

        Returns
        -------
        DwellStationRow | None
            The row; nothing if none holds.
        """
        minute_s = 60.0 * (departure_s // 60.0)
        for kind, from_s, until_s, row in self._of_station.get(station, ()):
            if kind in ("", train_type) and from_s <= minute_s < until_s:
                return row
        return None

    def held(self, station: str, train_type: str, departure_s: float) -> DwellStationRow:
        """
        Return the row that holds for a call of a checked timetable.

        Parameters
        ----------
        station
            Where the train calls.
        train_type
            Its type.
        departure_s
            Its booked departure, of which the whole minute counts. [s]

        Returns
        -------
        DwellStationRow
            The row.

        Raises
        ------
        LookupError
            If none holds.
        """
        row = self.find(station, train_type, departure_s)
        if row is None:
            msg = f"no dwell of {train_type!r} at {station!r} at {departure_s:g} s"
            raise LookupError(msg)
        return row
